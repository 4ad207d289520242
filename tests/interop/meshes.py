"""Reads surfaces written here (STL, PLY, VTP) with independent libraries: closed, facing outward, in LPS and mm.

    python meshes.py SURFACE...        needs trimesh (STL, PLY) and vtk (VTP) from PyPI
"""

import sys
from pathlib import Path


def with_trimesh(path):
    import trimesh

    mesh = trimesh.load(path, process=True)
    return mesh.is_watertight, mesh.volume, len(mesh.faces)


def with_vtk(path):
    import vtk

    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    surface = reader.GetOutput()
    edges = vtk.vtkFeatureEdges()
    edges.SetInputData(surface)
    edges.FeatureEdgesOff()
    edges.Update()
    space = surface.GetFieldData().GetAbstractArray("SPACE")
    if space is None or space.GetValue(0) != "LPS":
        raise SystemExit(f"{path}: no field SPACE that says LPS")
    mass = vtk.vtkMassProperties()
    mass.SetInputData(surface)
    return edges.GetOutput().GetNumberOfCells() == 0, mass.GetVolume(), surface.GetNumberOfPolys()


def main():
    if len(sys.argv) < 2:
        raise SystemExit(__doc__)
    volumes = []
    for path in map(Path, sys.argv[1:]):
        closed, volume, triangles = (with_vtk if path.suffix.lower() == ".vtp" else with_trimesh)(path)
        print(f"{path}: {triangles} triangles, {volume:.3f} mm3, {'closed' if closed else 'OPEN'}")
        if not closed or volume <= 0.0:
            raise SystemExit(f"{path}: not a closed surface that faces outward")
        volumes.append(volume)
    if max(volumes) > min(volumes) * 1.0001:
        raise SystemExit(f"the volumes differ: {volumes}")


main()
