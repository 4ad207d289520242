"""The cutting alone by another program: 300 sections of the same surface by VTK's cutter.

    python3 benches/peers/surface.py  from anywhere; needs cargo and a network for PyPI

Runs our benchmark (contours to closed surface, centreline and 300 sections), which leaves its surface and the planes of
its sections; then VTK cuts that surface with those planes. The least processor time of five runs; the areas are held
against ours. VMTK, which also makes the surface and the centreline, cannot be installed from PyPI. Installs what it needs into
target/peers.
"""

import json
import os
import subprocess
import sys

from environment import ROOT, least, with_packages

NEEDS = ["numpy==2.4.6", "vtk==9.7.2"]
FILES = ROOT / "target" / "bench-surface"


def cut(surface, planes):
    """Areas of the sections (mm2)."""
    from vtkmodules.vtkCommonDataModel import vtkPlane
    from vtkmodules.vtkFiltersCore import vtkCutter, vtkMassProperties, vtkStripper
    from vtkmodules.vtkFiltersGeneral import vtkContourTriangulator

    areas = []
    for plane in planes:
        at = vtkPlane()
        at.SetOrigin(plane[:3])
        at.SetNormal(plane[3:6])
        cutter = vtkCutter()
        cutter.SetInputData(surface)
        cutter.SetCutFunction(at)
        lines = vtkStripper()
        lines.SetInputConnection(cutter.GetOutputPort())
        filled = vtkContourTriangulator()
        filled.SetInputConnection(lines.GetOutputPort())
        measured = vtkMassProperties()
        measured.SetInputConnection(filled.GetOutputPort())
        areas.append(measured.GetSurfaceArea())
    return areas


def main():
    with_packages(NEEDS)
    import numpy as np
    from vtkmodules.vtkIOPLY import vtkPLYReader

    cargo = ["cargo", "bench", "-q", "-p", "probepath-recon", "--bench", "surface", *sys.argv[1:], "--"]
    env = os.environ | {"PROBEPATH_BENCH_FILES": str(FILES)}
    subprocess.run([*cargo, "sections/300"], cwd=ROOT, env=env, check=True)
    reader = vtkPLYReader()
    reader.SetFileName(str(FILES / "lumen.ply"))
    reader.Update()
    surface = reader.GetOutput()
    table = np.loadtxt(FILES / "planes.csv", delimiter=",")
    _, worked, areas = least(lambda: cut(surface, table))
    # The last plane touches the cap, where a cutter finds anything between nothing and all.
    apart = np.abs(np.array(areas)[1:-2] / table[1:-2, 6] - 1.0)
    print(f"{surface.GetNumberOfPolys()} triangles, {len(table)} planes")
    print(f"VTK 9.7 vtkCutter, one thread: {worked:.3f} s of processor time, areas at most {100 * apart.max():.2f} % from ours")
    FILES.joinpath("peers.json").write_text(json.dumps({"vtk_cut_s": worked, "planes": len(table)}))


main()
