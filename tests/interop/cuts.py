"""Resamples a volume with SimpleITK where probepath cut images out of it, and compares pixel by pixel.

usage: cuts.py EXPECTED.json

Nothing of probepath is used here. A cut's file holds its pixels, then its marks (1 where the volume was seen; it was
seen everywhere). Where a pixel lies on the border between two voxels to the last digits, or on the volume's, either
answer is right: such pixels are counted, and may be few.
"""

import json
import sys
from pathlib import Path

import numpy
import SimpleITK

WAYS = {"nearest": SimpleITK.sitkNearestNeighbor, "linear": SimpleITK.sitkLinear}
OUTSIDE = -1000.0


def resampled(volume, cut):
    """The cut as SimpleITK sees it; OUTSIDE where the volume is not."""
    grid = SimpleITK.Image([*cut["size"], 1], SimpleITK.sitkFloat64)
    grid.SetOrigin(cut["origin_mm"])
    grid.SetSpacing([*cut["spacing_mm"], 1.0])
    grid.SetDirection(cut["rotation"])
    plain = SimpleITK.Transform(3, SimpleITK.sitkIdentity)
    image = SimpleITK.Resample(volume, grid, plain, WAYS[cut["interpolation"]], OUTSIDE, SimpleITK.sitkFloat64)
    return SimpleITK.GetArrayFromImage(image)[0]


def main():
    path = Path(sys.argv[1])
    expected = json.loads(path.read_text())
    volume = SimpleITK.Cast(SimpleITK.ReadImage(str(path.parent / expected["volume"])), SimpleITK.sitkFloat64)
    pixels, off = 0, 0
    for cut in expected["cuts"]:
        width, height = cut["size"]
        data = numpy.fromfile(path.parent / cut["file"], dtype=numpy.uint8).reshape(2, height, width)
        theirs = resampled(volume, cut)
        inside = theirs > OUTSIDE / 2
        same = numpy.where(inside, numpy.abs(data[0] - theirs) <= 0.5 + 1e-6, data[0] == 0)
        same &= inside == (data[1] == 1)
        pixels, off = pixels + int(inside.sum()), off + int((~same).sum())
    if pixels < 1000 or off > pixels // 5000:
        sys.exit(f"{off} of {pixels} pixels differ")
    print(f"{len(expected['cuts'])} cuts, {pixels} pixels inside: {off} differ")


main()
