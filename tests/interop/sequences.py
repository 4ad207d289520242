"""Reads tracked sequences and volumes written here with SimpleITK (.mha, .mhd, .nrrd) and pynrrd (.nrrd).

usage: sequences.py EXPECTED.json

EXPECTED.json lies beside the files and says what the writer knows of each: sizes, the hash of the pixels, grids, and
for sequences every field of every image. Nothing of probepath is used here.
"""

import hashlib
import json
import sys
from decimal import Decimal
from pathlib import Path

import nrrd
import numpy
import SimpleITK

LONGEST_LINE = 1000  # of a header, for PLUS


def check(got, wanted, what):
    if got != wanted:
        sys.exit(f"{what}: {got!r} instead of {wanted!r}")


def near(got, wanted, what):
    if len(got) != len(wanted) or any(abs(a - b) > 1e-9 * max(1, abs(b)) for a, b in zip(got, wanted)):
        sys.exit(f"{what}: {got!r} instead of {wanted!r}")


def sha256(array):
    return hashlib.sha256(array.tobytes()).hexdigest()


def by_simpleitk(path):
    """Pixels (slowest axis first), the header's texts, spacing and origin."""
    image = SimpleITK.ReadImage(str(path))
    texts = {key: image.GetMetaData(key) for key in image.GetMetaDataKeys()}
    pixels = SimpleITK.GetArrayFromImage(image)
    near(image.GetDirection(), tuple(numpy.eye(image.GetDimension()).ravel()), f"{path}: directions")
    # ITK takes the list axis of a NRRD sequence for the components of a plane's pixels, and puts them last.
    if image.GetDimension() == 2:
        pixels = numpy.moveaxis(pixels.reshape(*image.GetSize()[::-1], -1), -1, 0)
    return pixels, texts, (image.GetSpacing(), image.GetOrigin())


def by_pynrrd(path):
    pixels, header = nrrd.read(str(path), index_order="C")
    # pynrrd 1.1.3 leaves the two escapes of NRRD's key/value pairs as they stand (a backslash is written twice).
    header = {key: value.replace("\\\\", "\\") if isinstance(value, str) else value for key, value in header.items()}
    grid = None
    if header.get("space") == "left-posterior-superior":
        directions = header["space directions"]
        grid = ([directions[i][i] for i in range(3)], list(header["space origin"]))
    return pixels, header, grid


def in_ascii(wanted):
    """pynrrd drops what is not ASCII."""
    return json.loads(json.dumps(wanted, ensure_ascii=False).encode("ascii", "ignore"))


def short_lines(path):
    header = path.read_bytes().split(b"ElementDataFile")[0].split(b"\n\n")[0]
    longest = max(map(len, header.split(b"\n")))
    check(longest <= LONGEST_LINE, True, f"{path}: a header line of {longest} characters")


def check_texts(texts, wanted, name):
    for key, value in wanted["fields"].items():
        check(texts.get(key), value, f"{name}: {key}")
    for image in wanted["images"]:
        check_image(lambda field: texts.get(f"Seq_Frame{image['number']:04}_{field}"), image, name)


def check_image(said, image, name):
    name = f"{name}: image {image['number']}"
    check(said("ImageStatus") or said("Status"), image["status"], f"{name}: status")
    stamp = said("Timestamp")
    check(stamp and str(int(Decimal(stamp).scaleb(9))), image["stamp_ns"], f"{name}: stamp")
    for key, value in image["fields"].items():
        check(said(key), value, f"{name}: {key}")
    for transform in image["transforms"]:
        between = f"{transform['from']}To{transform['to']}Transform"
        check([float(x) for x in said(between).split()], transform["rows"], f"{name}: {between}")
        check(said(f"{between}Status"), transform["status"], f"{name}: {between}Status")


def check_sequence(path, wanted):
    width, height, _ = wanted["size"]
    pictures = width > 0
    readers = [by_pynrrd] if path.suffix == ".nrrd" else []
    # Poses without images have no pixel in MetaImage, which ITK does not call an image.
    if pictures or path.suffix == ".nrrd":
        readers.append(by_simpleitk)
    for reader in readers:
        name = f"{path.name} ({reader.__name__})"
        pixels, texts, _ = reader(path)
        if pictures:
            check(list(pixels.shape[::-1]), wanted["size"], f"{name}: size")
            check(sha256(pixels), wanted["sha256"], f"{name}: pixels")
        check_texts(texts, in_ascii(wanted) if reader is by_pynrrd else wanted, name)
    return len(readers)


def check_volume(path, wanted):
    readers = [by_simpleitk, by_pynrrd] if path.suffix == ".nrrd" else [by_simpleitk]
    for reader in readers:
        name = f"{path.name} ({reader.__name__})"
        pixels, _, (spacing, origin) = reader(path)
        check(list(pixels.shape[::-1]), wanted["size"], f"{name}: size")
        check(sha256(pixels), wanted["sha256"], f"{name}: voxels")
        near(spacing, wanted["spacing_mm"], f"{name}: spacing")
        near(origin, wanted["origin_mm"], f"{name}: origin")
    return len(readers)


def main(expected):
    folder, expected = Path(expected).parent, json.loads(Path(expected).read_text())
    readings = 0
    for kind, one in (("sequences", check_sequence), ("volumes", check_volume)):
        for wanted in expected.get(kind, []):
            short_lines(folder / wanted["file"])
            readings += one(folder / wanted["file"], wanted)
    files = sum(map(len, expected.values()))
    print(f"{files} files read {readings} times: SimpleITK {SimpleITK.__version__}, pynrrd {nrrd.__version__}")


if __name__ == "__main__":
    main(sys.argv[1])
