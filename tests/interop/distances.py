"""Holds our signed distances against VTK's: the same points, the same closed surface, another program.

    python distances.py GOLD.vtp POINTS.vtp        needs vtk from PyPI

POINTS carries our answers as point data `signed_distance_mm`, negative inside.
"""

import sys

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkDoubleArray
from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader


def read(path):
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def main():
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    gold, points = read(sys.argv[1]), read(sys.argv[2])
    ours = vtk_to_numpy(points.GetPointData().GetArray("signed_distance_mm"))
    distance, theirs = vtkImplicitPolyDataDistance(), vtkDoubleArray()
    distance.SetInput(gold)
    distance.FunctionValue(points.GetPoints().GetData(), theirs)
    theirs = vtk_to_numpy(theirs)
    apart = abs(abs(ours) - abs(theirs)).max()
    # On the surface itself a sign is rounding.
    clear = abs(ours) > 1e-6
    wrong = int(((ours < 0) != (theirs < 0))[clear].sum())
    print(f"{len(ours)} points, {int((ours < 0).sum())} inside: at most {apart:.2e} mm apart, {wrong} signs differ")
    if apart > 1e-6 or wrong:
        raise SystemExit("our distances are not VTK's")


main()
