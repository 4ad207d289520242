"""The cutting alone by another program: 300 sections of the same surface by VTK's cutter.

    python3 benches/peers/surface_vtk.py              from anywhere; needs cargo and a network for PyPI

Runs our benchmark (contours to closed surface, centreline and 300 sections), which leaves its surface and the planes of
its sections; then VTK cuts that surface with those planes. The least processor time of five runs; the areas are held
against ours. VMTK, which also makes the surface and the centreline, cannot be installed from PyPI. Installs what it needs into
target/peers.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
VENV = ROOT / "target" / "peers"
NEEDS = ["numpy==2.4.6", "vtk==9.7.2"]
FILES = ROOT / "target" / "bench-surface"


def in_own_environment():
    python = VENV / "bin" / "python"
    if Path(sys.prefix).resolve() == VENV.resolve():
        return
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(VENV)], check=True)
    subprocess.run([str(python), "-m", "pip", "install", "-q", *NEEDS], check=True)
    os.execv(str(python), [str(python), __file__, *sys.argv[1:]])


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
    in_own_environment()
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
    times = []
    for _ in range(5):
        start = time.process_time()
        areas = cut(surface, table)
        times.append(time.process_time() - start)
    # The last plane touches the cap, where a cutter finds anything between nothing and all.
    apart = np.abs(np.array(areas)[1:-2] / table[1:-2, 6] - 1.0)
    print(f"{surface.GetNumberOfPolys()} triangles, {len(table)} planes")
    print(f"VTK 9.7 vtkCutter, one thread: {min(times):.3f} s of processor time, areas at most {100 * apart.max():.2f} % from ours")
    FILES.joinpath("peers.json").write_text(json.dumps({"vtk_cut_s": min(times), "planes": len(table)}))


main()
