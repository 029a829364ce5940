"""Segmentation objects of DICOM, written tag by tag."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.sequence import Sequence as DicomSequence
from pydicom.uid import ExplicitVRLittleEndian, SegmentationStorage, generate_uid

FloatArray = NDArray[np.float64]


def write_dicom_seg(segments: dict[str, NDArray[np.bool_]], T_lps_index: FloatArray, file: Path) -> None:
    """Write a binary segmentation object, frame by frame, leaving out empty frames (DICOM PS3.3, A.51 and C.8.20).

    Masks are (i, j, k): i along the columns' index, k along the slices.
    """
    spacing = np.linalg.norm(T_lps_index[:3, :3], axis=0)
    direction = T_lps_index[:3, :3] / spacing
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = SegmentationStorage
    meta.MediaStorageSOPInstanceUID = generate_uid()
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    data = FileDataset(str(file), {}, file_meta=meta, preamble=b"\0" * 128)
    data.SOPClassUID, data.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
    data.StudyInstanceUID, data.SeriesInstanceUID = generate_uid(), generate_uid()
    data.FrameOfReferenceUID = generate_uid()
    data.PatientName, data.PatientID, data.PatientBirthDate, data.PatientSex = "a^b", "1", "", ""
    data.StudyDate, data.StudyTime, data.StudyID, data.AccessionNumber = "20260101", "000000", "1", ""
    data.ReferringPhysicianName, data.Manufacturer, data.ManufacturerModelName = "", "tests", "tests"
    data.DeviceSerialNumber, data.SoftwareVersions = "1", "1"
    data.PositionReferenceIndicator = ""
    data.Modality, data.SeriesNumber, data.InstanceNumber = "SEG", "1", "1"
    data.ContentDate, data.ContentTime = "20260101", "000000"
    data.ContentLabel, data.ContentDescription, data.ContentCreatorName = "SEG", "", "a^b"
    data.ImageType, data.LossyImageCompression = ["DERIVED", "PRIMARY"], "00"
    data.SegmentationType = "BINARY"
    data.SamplesPerPixel, data.PhotometricInterpretation, data.PixelRepresentation = 1, "MONOCHROME2", 0
    data.BitsAllocated, data.BitsStored, data.HighBit = 1, 1, 0
    columns, rows, _ = next(iter(segments.values())).shape
    data.Rows, data.Columns = rows, columns
    data.SegmentSequence = DicomSequence([_segment(n, name) for n, name in enumerate(segments, start=1)])
    organisation = Dataset()
    organisation.DimensionOrganizationUID = generate_uid()
    data.DimensionOrganizationSequence = DicomSequence([organisation])
    data.DimensionIndexSequence = DicomSequence(
        [
            _dimension(organisation.DimensionOrganizationUID, 0x0062000B, 0x0062000A),
            _dimension(organisation.DimensionOrganizationUID, 0x00200032, 0x00209113),
        ]
    )
    shared, orientation, measures = Dataset(), Dataset(), Dataset()
    orientation.ImageOrientationPatient = [float(f"{v:.10g}") for v in (*direction[:, 0], *direction[:, 1])]
    measures.PixelSpacing = [float(spacing[1]), float(spacing[0])]
    measures.SliceThickness = measures.SpacingBetweenSlices = float(spacing[2])
    shared.PlaneOrientationSequence = DicomSequence([orientation])
    shared.PixelMeasuresSequence = DicomSequence([measures])
    data.SharedFunctionalGroupsSequence = DicomSequence([shared])
    frames, bits = [], []
    for number, mask in enumerate(segments.values(), start=1):
        for k in np.flatnonzero(mask.any(axis=(0, 1))).tolist():
            frames.append(_frame(number, k, T_lps_index))
            bits.append(mask[:, :, k].T)
    data.PerFrameFunctionalGroupsSequence = DicomSequence(frames)
    data.NumberOfFrames = len(frames)
    packed = np.packbits(np.concatenate([one.ravel() for one in bits]), bitorder="little").tobytes()
    data.PixelData = packed + b"\0" * (len(packed) % 2)
    data["PixelData"].VR = "OB"
    data.save_as(file, enforce_file_format=True)


def _segment(number: int, name: str) -> Dataset:
    segment, code = Dataset(), Dataset()
    code.CodeValue, code.CodingSchemeDesignator, code.CodeMeaning = "85756007", "SCT", "Tissue"
    segment.SegmentNumber, segment.SegmentLabel, segment.SegmentAlgorithmType = number, name, "MANUAL"
    segment.SegmentedPropertyCategoryCodeSequence = DicomSequence([code])
    segment.SegmentedPropertyTypeCodeSequence = DicomSequence([code])
    return segment


def _dimension(uid: str, pointer: int, group: int) -> Dataset:
    dimension = Dataset()
    dimension.DimensionOrganizationUID = uid
    dimension.DimensionIndexPointer, dimension.FunctionalGroupPointer = pointer, group
    return dimension


def _frame(number: int, k: int, T_lps_index: FloatArray) -> Dataset:
    frame, content, place, identity = Dataset(), Dataset(), Dataset(), Dataset()
    content.DimensionIndexValues = [number, k + 1]
    place.ImagePositionPatient = [float(f"{v:.10g}") for v in (T_lps_index @ [0, 0, k, 1])[:3]]
    identity.ReferencedSegmentNumber = number
    frame.FrameContentSequence = DicomSequence([content])
    frame.PlanePositionSequence = DicomSequence([place])
    frame.SegmentIdentificationSequence = DicomSequence([identity])
    return frame
