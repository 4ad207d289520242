"""The same distances by other programs: 100,000 points to a surface of 100,000 triangles.

    python3 benches/peers/compare.py  from anywhere; needs cargo and a network for PyPI

Writes points and surface with our benchmark, runs it, then Open3D (on one thread and on all), VTK and trimesh, each
with the time for its own tree inside. The least of five runs, by the clock and in processor time (which does not count
what else the computer does); the distances are held against ours.
Installs what it needs into target/peers.
"""

import json
import os
import subprocess
import sys

from environment import ROOT, least, with_packages

NEEDS = ["numpy==2.4.6", "open3d==0.20.0", "vtk==9.7.2", "trimesh==5.2.0", "rtree==1.4.1", "scipy==1.17.1"]
FILES = ROOT / "target" / "bench-compare"


def ply(path):
    """Points, triangles and the numbers of a binary PLY of ours."""
    import numpy as np

    raw = path.read_bytes()
    head, body = raw.split(b"end_header\n", 1)
    lines = head.decode().splitlines()
    counts = [int(line.split()[2]) for line in lines if line.startswith("element")]
    names = [line.split()[2] for line in lines if line.startswith("property double")]
    table = np.frombuffer(body, "<f8", counts[0] * len(names)).reshape(counts[0], len(names))
    faces = np.frombuffer(body, np.dtype([("n", "u1"), ("corner", "<i4", 3)]), counts[1], counts[0] * len(names) * 8)
    return table[:, :3].copy(), faces["corner"].copy(), {name: table[:, i] for i, name in enumerate(names)}


def open3d(points, triangles, vertices, threads):
    import numpy as np
    import open3d as o3d

    p, v = np.float32(points), np.float32(vertices)

    def work():
        scene = o3d.t.geometry.RaycastingScene(nthreads=threads)
        scene.add_triangles(o3d.core.Tensor(v), o3d.core.Tensor(np.uint32(triangles)))
        return scene.compute_distance(o3d.core.Tensor(p), nthreads=threads).numpy()

    return work


def vtk(points, triangles, vertices):
    import numpy as np
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

    corners = vtkPoints()
    corners.SetData(numpy_to_vtk(vertices, deep=True))
    cells = vtkCellArray()
    cells.SetData(3, numpy_to_vtkIdTypeArray(np.int64(triangles).ravel(), deep=True))
    surface = vtkPolyData()
    surface.SetPoints(corners)
    surface.SetPolys(cells)

    def work():
        distance, out = vtkImplicitPolyDataDistance(), vtkDoubleArray()
        distance.SetInput(surface)
        distance.FunctionValue(numpy_to_vtk(points, deep=True), out)
        return np.abs(vtk_to_numpy(out))

    return work


def trimesh(points, triangles, vertices):
    import trimesh

    def work():
        mesh = trimesh.Trimesh(vertices, triangles, process=False)
        return trimesh.proximity.closest_point(mesh, points)[1]

    return work


def main():
    with_packages(NEEDS)
    import numpy as np

    cargo = ["cargo", "bench", "-q", "-p", "probepath-recon", "--bench", "compare", *sys.argv[1:], "--"]
    env = os.environ | {"PROBEPATH_BENCH_FILES": str(FILES)}
    subprocess.run([*cargo, "in the order of a grid"], cwd=ROOT, env=env, check=True)
    vertices, triangles, _ = ply(FILES / "gold.ply")
    points, _, numbers = ply(FILES / "points.ply")
    ours = numbers["distance_mm"]
    print(f"{len(points)} points, {len(triangles)} triangles; the least of five runs (trimesh: one), the tree inside")
    peers = [
        ("Open3D 0.20, one thread (single precision)", open3d(points, triangles, vertices, 1), 5),
        ("Open3D 0.20, all threads", open3d(points, triangles, vertices, 0), 5),
        ("VTK 9.7 vtkImplicitPolyDataDistance, one thread", vtk(points, triangles, vertices), 5),
        ("trimesh 5.2 closest_point, one thread", trimesh(points, triangles, vertices), 1),
    ]
    rows = []
    for name, work, times in peers:
        try:
            seconds, worked, found = least(work, times)
        except Exception as error:  # a peer that cannot run here is no reason not to time the others
            print(f"{name:52} not run: {error}")
            continue
        apart = float(np.abs(found - ours).max())
        rows.append({"peer": name, "seconds": seconds, "processor_s": worked, "apart_mm": apart})
        print(f"{name:52} {seconds:8.3f} s, {worked:.3f} s of processors   at most {apart:.2e} mm from ours")
    (FILES / "peers.json").write_text(json.dumps(rows, indent=1))


main()
