"""Reads DICOM files written here as strangers do: pydicom with every value checked, and highdicom for the report's tree.

    python dicom.py US_MULTI_FRAME ENCAPSULATED_STL STRUCTURED_REPORT      needs pydicom and highdicom from PyPI

dicom-validator (PyPI) fetches the standard from the internet before it checks anything, so it cannot be part of the
tests; where it can run: `validate_iods FILE`. What it would look for first, the attributes that each kind of file must
have (PS3.3), is the table below.
"""

import io
import struct
import sys
import warnings

import pydicom
from pydicom import config

# Every warning about a value or a representation is a failure.
config.settings.reading_validation_mode = config.RAISE
warnings.simplefilter("error")

# Attributes that must be there: with a value (1), or perhaps empty (2). PS3.3, the modules named.
PATIENT = {"PatientName": 2, "PatientID": 2, "PatientBirthDate": 2, "PatientSex": 2, "PatientIdentityRemoved": 1,
           "DeidentificationMethod": 1}  # C.7.1.1
STUDY = {"StudyInstanceUID": 1, "StudyDate": 2, "StudyTime": 2, "ReferringPhysicianName": 2, "StudyID": 2,
         "AccessionNumber": 2}  # C.7.2.1
SERIES = {"Modality": 1, "SeriesInstanceUID": 1, "SeriesNumber": 1}  # C.7.3.1
EQUIPMENT = {"Manufacturer": 1, "ManufacturerModelName": 1, "DeviceSerialNumber": 1, "SoftwareVersions": 1}  # C.7.5.2
COMMON = {"SOPClassUID": 1, "SOPInstanceUID": 1, "InstanceNumber": 1}  # C.12.1
ALL = PATIENT | STUDY | SERIES | EQUIPMENT | COMMON
US = ALL | {
    "ImageType": 1, "PatientOrientation": 2, "SamplesPerPixel": 1, "PhotometricInterpretation": 1, "Rows": 1, "Columns": 1,
    "BitsAllocated": 1, "BitsStored": 1, "HighBit": 1, "PixelRepresentation": 1, "PixelData": 1,  # C.7.6.3, C.8.5.6
    "NumberOfFrames": 1, "FrameIncrementPointer": 1, "FrameTimeVector": 1,  # C.7.6.5, C.7.6.6
    "SequenceOfUltrasoundRegions": 1, "LossyImageCompression": 1,
}
REGION = {name: 1 for name in (
    "RegionSpatialFormat", "RegionDataType", "RegionFlags", "RegionLocationMinX0", "RegionLocationMinY0",
    "RegionLocationMaxX1", "RegionLocationMaxY1", "PhysicalUnitsXDirection", "PhysicalUnitsYDirection",
    "PhysicalDeltaX", "PhysicalDeltaY")}  # C.8.5.5
STL = ALL | {
    "FrameOfReferenceUID": 1, "PositionReferenceIndicator": 2, "ContentDate": 2, "ContentTime": 2, "AcquisitionDateTime": 2,
    "BurnedInAnnotation": 1, "DocumentTitle": 2, "ConceptNameCodeSequence": 2, "MIMETypeOfEncapsulatedDocument": 1,
    "EncapsulatedDocument": 1, "EncapsulatedDocumentLength": 1, "MeasurementUnitsCodeSequence": 1,  # C.24.2, C.35.1
}
SR = ALL | {
    "ReferencedPerformedProcedureStepSequence": 2, "CompletionFlag": 1, "VerificationFlag": 1, "ContentDate": 1,
    "ContentTime": 1, "PerformedProcedureCodeSequence": 2, "ValueType": 1, "ConceptNameCodeSequence": 1,
    "ContinuityOfContent": 1, "ContentSequence": 1,  # C.17
}


def need(condition, what):
    if not condition:
        raise SystemExit(what)


def required(data, table, what):
    for name, kind in table.items():
        need(name in data, f"{what}: {name} is missing")
        value = data[name].value
        empty = value is None or (hasattr(value, "__len__") and len(value) == 0)
        need(kind == 2 or not empty, f"{what}: {name} is empty")


def read(path, table, what):
    data = pydicom.dcmread(path)
    for element in data.iterall():
        element.value  # decoded, so checked
    required(data, table, what)
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
    data = read(path, US, "US multi-frame")
    pixels = data.pixel_array
    need(pixels.shape == (int(data.NumberOfFrames), data.Rows, data.Columns), f"pixels of {pixels.shape}")
    times = [float(t) for t in data.FrameTimeVector]
    need(len(times) == len(pixels) and times[0] == 0 and all(t > 0 for t in times[1:]), f"times {times}")
    need(data.FrameIncrementPointer == 0x00181065, "the frames do not follow the vector of times")
    for region in data.SequenceOfUltrasoundRegions:
        required(region, REGION, "region")
        need(region.PhysicalUnitsXDirection == 3 == region.PhysicalUnitsYDirection, "the region is not in centimetres")
        need(0.0001 < region.PhysicalDeltaX < 0.1 and 0.0001 < region.PhysicalDeltaY < 0.1, "no size of a pixel")
        need((region.RegionLocationMaxX1, region.RegionLocationMaxY1) == (data.Columns - 1, data.Rows - 1), "its corner")
    print(f"{path}: {pixels.shape} frames, {data.SequenceOfUltrasoundRegions[0].PhysicalDeltaX} cm a column")
    return data


def stl(path):
    data = read(path, STL, "encapsulated STL")
    need(data.MIMETypeOfEncapsulatedDocument == "model/stl", "MIME type")
    need(data.MeasurementUnitsCodeSequence[0].CodeValue == "mm", "unit")
    inside = data.EncapsulatedDocument[: data.EncapsulatedDocumentLength]
    triangles = struct.unpack_from("<I", inside, 80)[0]
    need(len(inside) == 84 + 50 * triangles and b"SPACE=LPS" in inside[:80], "the STL inside")
    print(f"{path}: {triangles} triangles")
    return data


def report(path):
    import highdicom

    data = read(path, SR, "structured report")
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        document = highdicom.sr.srread(path)
    need(type(document).__name__ == "Comprehensive3DSR", f"highdicom reads a {type(document).__name__}")
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
