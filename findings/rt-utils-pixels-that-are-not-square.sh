#!/usr/bin/env bash
# rt-utils 1.2.7 (DICOM RTSTRUCT): contours elsewhere for oblong pixels, half a mask back from a wide picture
#
# Expected: `add_roi` writes the outline of a mask in mm of the patient, `get_roi_mask_by_name` gives that mask back.
# What happens: the first value of PixelSpacing, the distance of rows, is taken for that of columns, and the other way
# round: with rows 2 mm and columns 1 mm apart a block lies 50 mm and 30 mm off and has other sides. Its own reader
# swaps them back, so that only other programs show it. The mask that comes back has rows and columns of the picture
# changed over, but not the contents: of 60 rows and 100 columns, columns beyond 60 are cut off. And the outline goes
# through the centres of the outer pixels (known): a block of 20 by 10 pixels loses 14 % of its area in any program
# that measures the polygon. No warning.
# Why it matters: organ and tumour from a segmentation become a mesh; volumes, places and contact with the tool are off.
# Instead: DICOM SEG (highdicom), or write contours yourself along the edges of pixels; compare one block by hand.
#
# Mask: 10 rows (30 to 39) and 20 columns (50 to 69) in each of three slices, first pixel at the origin.
#
# Seen:
#   rows 2 mm, columns 1 mm apart: x 100 to 138 mm (true 50 to 69), y 30 to 39 mm (true 60 to 78)
#   square pixels of 1 mm: area 171 mm2, of the pixels 200 mm2
#   wide picture: mask given (60, 100, 3) with 600 voxels, back (100, 60, 3) with 300
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet pydicom==3.0.2 opencv-python-headless==5.0.0.93 numpy==2.4.6
venv/bin/pip install --quiet --no-deps rt-utils==1.2.7

venv/bin/python - <<'PYTHON'
import contextlib
import warnings
from pathlib import Path

import numpy as np
import pydicom
from pydicom.dataset import Dataset, FileMetaDataset
from rt_utils import RTStructBuilder

warnings.simplefilter("ignore")
MR_IMAGE = "1.2.840.10008.5.1.4.1.1.4"
SLICES = 3
ROWS, COLUMNS = slice(30, 40), slice(50, 70)


def write_series(folder, rows, columns, spacing_mm):
    """Axial slices 1 mm apart, first pixel at the origin; spacing between rows, then between columns."""
    folder.mkdir()
    study, series, frame = (pydicom.uid.generate_uid() for _ in range(3))
    for number in range(SLICES):
        image = Dataset()
        image.SOPClassUID, image.SOPInstanceUID = MR_IMAGE, pydicom.uid.generate_uid()
        image.StudyInstanceUID, image.SeriesInstanceUID, image.FrameOfReferenceUID = study, series, frame
        image.StudyDate, image.StudyTime, image.StudyID, image.Modality = "20260101", "120000", "1", "MR"
        image.PatientName, image.PatientID = "Phantom", "1"
        image.ImageOrientationPatient, image.ImagePositionPatient = [1, 0, 0, 0, 1, 0], [0, 0, number]
        image.PixelSpacing, image.SliceThickness, image.InstanceNumber = spacing_mm, 1, number + 1
        image.Rows, image.Columns, image.SamplesPerPixel = rows, columns, 1
        image.PhotometricInterpretation, image.PixelRepresentation = "MONOCHROME2", 0
        image.BitsAllocated, image.BitsStored, image.HighBit = 16, 16, 15
        image.PixelData = np.zeros((rows, columns), np.uint16).tobytes()
        image.file_meta = FileMetaDataset()
        image.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        image.save_as(folder / f"{number}.dcm", enforce_file_format=True)


def through_rt_utils(name, rows, columns, spacing_mm):
    """The contour in the file, in mm, the mask given and the mask that comes back."""
    write_series(Path(name), rows, columns, spacing_mm)
    mask = np.zeros((rows, columns, SLICES), bool)
    mask[ROWS, COLUMNS] = True
    with contextlib.redirect_stdout(None):
        made = RTStructBuilder.create_new(name)
        made.add_roi(mask, name="tumour")
        made.save(f"{name}.dcm")
    back = RTStructBuilder.create_from(name, f"{name}.dcm").get_roi_mask_by_name("tumour")
    contour = pydicom.dcmread(f"{name}.dcm").ROIContourSequence[0].ContourSequence[0].ContourData
    return np.array(contour, float).reshape(-1, 3), mask, back


contour, mask, _ = through_rt_utils("oblong", 100, 100, [2, 1])
low, high = contour.min(0), contour.max(0)
print(f"rows 2 mm, columns 1 mm apart: x {low[0]:.0f} to {high[0]:.0f} mm (true 50 to 69), ", end="")
print(f"y {low[1]:.0f} to {high[1]:.0f} mm (true 60 to 78)")
square, _, _ = through_rt_utils("square", 100, 100, [1, 1])
area = np.ptp(square[:, 0]) * np.ptp(square[:, 1])
print(f"square pixels of 1 mm: area {area:.0f} mm2, of the pixels {mask[..., 0].sum()} mm2")
_, given, back = through_rt_utils("wide", 60, 100, [1, 1])
print(f"wide picture: mask given {given.shape} with {given.sum()} voxels, back {back.shape} with {back.sum()}")
if np.allclose(low[:2], [50, 60]) or np.allclose(high[:2], [69, 78]):
    raise SystemExit("changed: the spacings are in their places")
if not np.allclose(low[:2], [100, 30]) or area > 180:
    raise SystemExit("changed: the contour lies elsewhere again")
if back.shape == given.shape or back.sum() == given.sum():
    raise SystemExit("changed: the mask comes back as it was")
PYTHON
