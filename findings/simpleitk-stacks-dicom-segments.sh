#!/usr/bin/env bash
# SimpleITK 2.5.7: the segments of a DICOM segmentation become further slices of one
#
# Expected: a SEG object of an organ in slices 2 to 5 and a tumour in slice 4 is read as a label map on the slices'
# grid, or refused.
# What happens: the frames are stacked in the order of the file: five slices, of which the last one, beyond the organ,
# is the tumour. Nothing tells which slice is of which segment, and the spacing is another one than in the file. Where
# a frame has no multiple of eight pixels, there are more voxels than in the file, too. No warning.
# Why it matters: the tumour sits at the end of the organ, which is longer than it is.
# Instead: highdicom, `segread(file).get_volume(combine_segments=True)`, with its affine (LPS).
#
# Seen:
#   8 x 8 pixels: SimpleITK 5 slices, voxels in each [4, 4, 4, 4, 1], the last at z = 14.0; highdicom tumour at z = 10.0 mm
#   6 x 6 pixels: SimpleITK 5 slices, voxels in each [4, 4, 4, 4, 5], the last at z = 14.0; highdicom tumour at z = 10.0 mm
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet highdicom==0.28.2 pydicom==3.0.2 SimpleITK==2.5.7 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import warnings

import highdicom as hd
import numpy as np
import SimpleITK as sitk
from pydicom.dataset import FileMetaDataset
from pydicom.sr.codedict import codes
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid
from pydicom.dataset import Dataset

warnings.simplefilter("ignore")
SPACING = 2.5


def slice_of_ct(number, edge, study, series, frame):
    image = Dataset()
    image.file_meta = FileMetaDataset()
    image.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    image.SOPClassUID, image.SOPInstanceUID = CTImageStorage, generate_uid()
    image.StudyInstanceUID, image.SeriesInstanceUID, image.FrameOfReferenceUID = study, series, frame
    image.PatientID, image.PatientName, image.PatientBirthDate, image.PatientSex = "1", "a^b", "", ""
    image.StudyID, image.StudyDate, image.StudyTime, image.AccessionNumber = "1", "20260101", "000000", ""
    image.ReferringPhysicianName, image.Modality, image.InstanceNumber = "", "CT", number + 1
    image.Rows = image.Columns = edge
    image.PixelSpacing, image.SliceThickness = [1.0, 1.0], SPACING
    image.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
    image.ImagePositionPatient = [0.0, 0.0, number * SPACING]
    image.SamplesPerPixel, image.PhotometricInterpretation = 1, "MONOCHROME2"
    image.BitsAllocated, image.BitsStored, image.HighBit, image.PixelRepresentation = 16, 16, 15, 0
    image.PixelData = bytes(2 * edge**2)
    return image


segments = [
    hd.seg.SegmentDescription(n, name, codes.SCT.Tissue, codes.SCT.Tissue, hd.seg.SegmentAlgorithmTypeValues.MANUAL)
    for n, name in ((1, "organ"), (2, "tumour"))
]
seen = {}
for edge in (8, 6):
    uids = [generate_uid() for _ in range(3)]
    images = [slice_of_ct(number, edge, *uids) for number in range(8)]
    mask = np.zeros((8, edge, edge), np.uint8)
    mask[1:5, 1:3, 1:3] = 1
    mask[4, 4, 4] = 2
    hd.seg.Segmentation(
        images, mask, "BINARY", segments, generate_uid(), 2, generate_uid(), 1, "a", "b", "1", "1"
    ).save_as("seg.dcm")
    volume = sitk.ReadImage("seg.dcm")
    counts = [int((one > 0).sum()) for one in sitk.GetArrayFromImage(volume)]
    last = round(volume.TransformIndexToPhysicalPoint((0, 0, volume.GetSize()[2] - 1))[2], 6)
    right = hd.seg.segread("seg.dcm").get_volume(combine_segments=True)
    (index,) = np.argwhere(right.array == 2)
    place = float((right.affine @ (*index, 1))[2])
    seen[edge] = (counts, last != place)
    print(
        f"{edge} x {edge} pixels: SimpleITK {len(counts)} slices, voxels in each {counts}, the last at z = {last}; "
        f"highdicom tumour at z = {place} mm"
    )
if seen != {8: ([4, 4, 4, 4, 1], True), 6: ([4, 4, 4, 4, 5], True)}:
    raise SystemExit("changed: SimpleITK no longer stacks the segments, or unpacks them otherwise")
PYTHON
