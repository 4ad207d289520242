"""Reads DICOM files written here as strangers do: pydicom with every value checked, and highdicom for the report's tree.

    python dicom.py US_MULTI_FRAME ENCAPSULATED_STL STRUCTURED_REPORT      needs pydicom and highdicom from PyPI

dicom-validator (PyPI) fetches the standard from the internet before it checks anything, so it cannot be part of the
tests; where it can run: `validate_iods FILE`. Its first question, whether every attribute that a kind of file must have is
there and none that it cannot have (PS3.3), is asked here, of the tables of the standard that highdicom brings along.
"""

import io
import json
import struct
import sys
import warnings
from pathlib import Path

import highdicom
import pydicom
from pydicom import config

# Every warning about a value or a representation is a failure.
config.settings.reading_validation_mode = config.RAISE
warnings.simplefilter("error")

STANDARD = Path(highdicom.__file__).parent / "_standard"
# A module that a kind of file may do without, and that these files hold all the same.
HELD = {"us-region-calibration"}
# What an item of a report's tree must have depends on its kind, which the tables do not say: `report` looks at the tree.
BY_KIND = {"sr-document-content"}


def need(condition, what):
    if not condition:
        raise SystemExit(what)


def tables(sop_class):
    """The attributes of a kind of file: those of its mandatory modules and of the ones in HELD, and all there may be."""
    name = json.loads((STANDARD / "sop_class_iod_map.json").read_text())[sop_class]
    modules = json.loads((STANDARD / "iod_module_map.json").read_text())[name]
    attributes = json.loads((STANDARD / "module_attribute_map.json").read_text())
    held = [m["key"] for m in modules if (m["usage"] == "M" or m["key"] in HELD) and m["key"] not in BY_KIND]
    due = [attribute for key in held for attribute in attributes[key]]
    known = {(*a["path"], a["keyword"]) for m in modules for a in attributes[m["key"]]}
    return name, due, known


def inside(data, path):
    """The items of a sequence in a sequence; none where one is absent or empty."""
    items = [data]
    for keyword in path:
        items = [deeper for item in items if keyword in item for deeper in item[keyword].value or []]
    return items


def required(data, what):
    """Type 1: there, with a value. Type 2: there. Those with a condition (1C, 2C) are not asked for."""
    name, due, known = tables(data.SOPClassUID)
    for attribute in due:
        keyword, kind = attribute["keyword"], attribute["type"]
        for item in inside(data, attribute["path"]) if kind in ("1", "2") else []:
            need(keyword in item, f"{what} ({name}): {keyword} is missing in {attribute['path']}")
            value = item[keyword].value
            empty = value is None or (hasattr(value, "__len__") and len(value) == 0)
            need(kind == "2" or not empty, f"{what} ({name}): {keyword} is empty")
    strange = [element.keyword for element in data if (element.keyword,) not in known]
    need(not strange, f"{what} ({name}): nothing of the kind has {strange}")


def read(path, what):
    data = pydicom.dcmread(path)
    for element in data.iterall():
        element.value  # decoded, so checked
    required(data, what)
    need(data.file_meta.TransferSyntaxUID == "1.2.840.10008.1.2.1", f"{what}: not explicit little endian")
    need(data.file_meta.MediaStorageSOPInstanceUID == data.SOPInstanceUID, f"{what}: two instance UIDs")
    uids = [e.value for e in data.iterall() if e.VR == "UI"]
    need(all(uid.is_valid for uid in uids), f"{what}: a UID that is none")
    need(data.PatientName == data.PatientID and data.PatientIdentityRemoved == "YES", f"{what}: a name?")
    again = io.BytesIO()
    data.save_as(again, enforce_file_format=True)
    need(pydicom.dcmread(io.BytesIO(again.getvalue())) == data, f"{what}: pydicom does not write what it read")
    return data


def multi_frame(path):
    data = read(path, "US multi-frame")
    pixels = data.pixel_array
    need(pixels.shape == (int(data.NumberOfFrames), data.Rows, data.Columns), f"pixels of {pixels.shape}")
    times = [float(t) for t in data.FrameTimeVector]
    need(len(times) == len(pixels) and times[0] == 0 and all(t > 0 for t in times[1:]), f"times {times}")
    need(data.FrameIncrementPointer == 0x00181065, "the frames do not follow the vector of times")
    for region in data.SequenceOfUltrasoundRegions:
        need(region.PhysicalUnitsXDirection == 3 == region.PhysicalUnitsYDirection, "the region is not in centimetres")
        need(0.0001 < region.PhysicalDeltaX < 0.1 and 0.0001 < region.PhysicalDeltaY < 0.1, "no size of a pixel")
        need((region.RegionLocationMaxX1, region.RegionLocationMaxY1) == (data.Columns - 1, data.Rows - 1), "its corner")
    print(f"{path}: {pixels.shape} frames, {data.SequenceOfUltrasoundRegions[0].PhysicalDeltaX} cm a column")
    return data


def stl(path):
    data = read(path, "encapsulated STL")
    need(data.MIMETypeOfEncapsulatedDocument == "model/stl", "MIME type")
    need(data.MeasurementUnitsCodeSequence[0].CodeValue == "mm", "unit")
    inside = data.EncapsulatedDocument[: data.EncapsulatedDocumentLength]
    triangles = struct.unpack_from("<I", inside, 80)[0]
    need(len(inside) == 84 + 50 * triangles and b"SPACE=LPS" in inside[:80], "the STL inside")
    print(f"{path}: {triangles} triangles")
    return data


def report(path):
    data = read(path, "structured report")
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        document = highdicom.sr.srread(path)
    need(type(document).__name__ == "Comprehensive3DSR", f"highdicom reads a {type(document).__name__}")
    for name in ("ValueType", "ConceptNameCodeSequence", "ContinuityOfContent", "ContentSequence"):
        need(data.get(name), f"structured report: {name} is missing or empty")
    numbers = {}

    def walk(items, inside):
        for item in items:
            name = item.ConceptNameCodeSequence[0].CodeMeaning
            if item.ValueType == "NUM":
                value = item.MeasuredValueSequence[0]
                unit = value.MeasurementUnitsCodeSequence[0].CodeValue
                numbers[inside + name] = (float(value.NumericValue), unit)
                need(abs(float(value.NumericValue) - value.FloatingPointValue) < 1e-3, f"{name}: two values")
            if item.ValueType == "SCOORD3D":
                need(len(item.GraphicData) == 3 and item.ReferencedFrameOfReferenceUID, "a place without a frame")
            if "ContentSequence" in item:
                walk(item.ContentSequence, inside + (f"{name} > " if item.ValueType == "NUM" else ""))

    walk(data.ContentSequence, "")
    for name, (value, unit) in numbers.items():
        print(f"{path}: {name} = {value} {unit}")
    texts = [e.value for e in data.iterall() if e.keyword == "TextValue"]
    need(any("not a Doppler grade" in text for text in texts), "the report does not say what it is not")
    return data


def main():
    if len(sys.argv) != 4:
        raise SystemExit(__doc__)
    files = [read_one(path) for read_one, path in zip((multi_frame, stl, report), sys.argv[1:])]
    need(len({data.StudyInstanceUID for data in files}) == 1, "not one study")
    need(len({data.SeriesInstanceUID for data in files}) == 3, "not three series")
    need(files[1].FrameOfReferenceUID in str(files[2]), "the report's places are in another frame than the surface")


main()
