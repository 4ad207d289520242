"""The same work by other programs: pixels into voxels, holes filled, an image cut out.

    python3 benches/peers/volume.py  from anywhere; needs a network for PyPI

The geometry is that of `recon/benches/volume.rs`. What there is on PyPI: no program for freehand volumes (IGSIO's, which
PLUS and 3D Slicer use, is not there; its figures in docs and README are quoted, from another machine), so pixels go into
voxels by numpy's `bincount`, as a script would do it; scipy fills each hole from the nearest seen voxel (which, unlike
ours, also fills what no image swept); SimpleITK and VTK cut. CPU time, the least of some runs each; all use one core.
Installs what it needs into target/peers.
"""

import os
import time

from environment import least, with_packages

NEEDS = ["numpy==2.4.6", "scipy==1.17.1", "SimpleITK==2.5.7", "vtk==9.7.2"]
IMAGES = 12
SIZE = (220, 165, 30)  # x, y, z voxels of 0.3 mm


def places(numpy, image):
    """Places of all pixels of an image, in voxels of 0.3 mm."""
    turn = 0.002 * image
    u, v = numpy.meshgrid(numpy.arange(640), numpy.arange(480))
    x, y, z = 0.1 * numpy.cos(turn) * u, 0.1 * v, 0.5 * image + 0.1 * numpy.sin(turn) * u
    return [axis.ravel() / 0.3 for axis in (x, y, z)]


def nearest(numpy, pixels):
    sums, counts = numpy.zeros(numpy.prod(SIZE)), numpy.zeros(numpy.prod(SIZE))
    for image in range(IMAGES):
        x, y, z = [numpy.rint(axis).astype(numpy.int64) for axis in places(numpy, image)]
        index = (z * SIZE[1] + y) * SIZE[0] + x
        sums += numpy.bincount(index, pixels, len(sums))
        counts += numpy.bincount(index, minlength=len(sums))
    return sums / numpy.maximum(counts, 1)


def linear(numpy, pixels):
    sums, counts = numpy.zeros(numpy.prod(SIZE)), numpy.zeros(numpy.prod(SIZE))
    for image in range(IMAGES):
        at = places(numpy, image)
        low = [numpy.floor(axis).astype(numpy.int64) for axis in at]
        part = [axis - first for axis, first in zip(at, low)]
        for corner in range(8):
            far = [corner >> axis & 1 for axis in range(3)]
            weight = numpy.prod([p if f else 1 - p for p, f in zip(part, far)], axis=0)
            x, y, z = [first + f for first, f in zip(low, far)]
            index = (z * SIZE[1] + y) * SIZE[0] + x
            sums += numpy.bincount(index, weight * pixels, len(sums))
            counts += numpy.bincount(index, weight, len(sums))
    return sums / numpy.maximum(counts, 1e-9)


def fill(numpy):
    """Nearest seen voxel by scipy's distance transform, two of three layers unseen; an eighth of 131 million voxels."""
    from scipy import ndimage

    grey = numpy.random.default_rng(1).integers(0, 255, (214, 240, 320), dtype=numpy.uint8)
    unseen = numpy.ones(grey.shape, dtype=bool)
    unseen[::3] = False

    def work():
        nearest = ndimage.distance_transform_edt(unseen, return_distances=False, return_indices=True)
        return grey[tuple(nearest)]

    return least(work, 1)[1] * 131.2e6 / grey.size


def cuts(numpy):
    import SimpleITK
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk

    grey = numpy.random.default_rng(1).integers(0, 255, (101, 161, 215), dtype=numpy.uint8)
    volume = SimpleITK.GetImageFromArray(grey)
    volume.SetSpacing([0.3] * 3)
    turn = SimpleITK.VersorTransform([0.4, 0.3, 0.2], 0.54).GetMatrix()
    grid = SimpleITK.Image([640, 480, 1], SimpleITK.sitkUInt8)
    grid.SetSpacing([0.1, 0.1, 1.0])
    grid.SetOrigin([10.0, 0.0, 10.0])
    grid.SetDirection(turn)
    plain = SimpleITK.Transform(3, SimpleITK.sitkIdentity)
    SimpleITK.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
    by_simpleitk = least(lambda: SimpleITK.Resample(volume, grid, plain, SimpleITK.sitkLinear), 5)[1]

    image = vtk.vtkImageData()
    image.SetDimensions(grey.shape[::-1])
    image.SetSpacing([0.3] * 3)
    image.GetPointData().SetScalars(numpy_to_vtk(grey.ravel(), deep=True))
    reslice = vtk.vtkImageReslice()
    reslice.SetInputData(image)
    reslice.SetResliceAxesDirectionCosines([turn[row * 3 + column] for column in range(3) for row in range(3)])
    reslice.SetResliceAxesOrigin([10.0, 0.0, 10.0])
    reslice.SetOutputDimensionality(2)
    reslice.SetOutputExtent(0, 639, 0, 479, 0, 0)
    reslice.SetOutputSpacing([0.1, 0.1, 1.0])
    reslice.SetOutputOrigin([0, 0, 0])
    reslice.SetInterpolationModeToLinear()
    reslice.SetNumberOfThreads(1)

    def by_vtk():
        reslice.Modified()
        reslice.Update()

    return by_simpleitk, least(by_vtk, 5)[1]


def main():
    with_packages(NEEDS)
    import numpy

    pixels = ((numpy.arange(640 * 480, dtype=numpy.uint64) * 2_654_435_761 % 2**32) >> 24).astype(float)
    print(f"numpy bincount, nearest, mean:   {least(lambda: nearest(numpy, pixels), 3)[1] / IMAGES * 1e3:7.1f} ms an image")
    print(f"numpy bincount, linear, mean:    {least(lambda: linear(numpy, pixels), 2)[1] / IMAGES * 1e3:7.1f} ms an image")
    by_simpleitk, by_vtk = cuts(numpy)
    print(f"SimpleITK resample, 640 x 480:   {by_simpleitk * 1e3:7.1f} ms, one thread, linear")
    print(f"VTK image reslice, 640 x 480:    {by_vtk * 1e3:7.1f} ms, one thread, linear")
    print(f"scipy nearest seen voxel:        {fill(numpy):7.1f} s for 131 million voxels, from an eighth of them")


if __name__ == "__main__":
    main()
