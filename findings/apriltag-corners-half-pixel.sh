#!/usr/bin/env bash
# pupil-apriltags 1.0.4.post11 and OpenCV 5.0.0: corners half a pixel apart
#
# Expected: two detectors of one tag in one picture agree to a tenth of a pixel, and so do two refinements of one
# detector.
# What happens: AprilTag counts from the corner of the first pixel, OpenCV (camera matrix, `solvePnP`,
# `cornerSubPix`) from its centre. pupil-apriltags gives every corner half a pixel to the right and below. OpenCV's
# own CORNER_REFINE_APRILTAG brings that offset into OpenCV (0.4 px), where CORNER_REFINE_SUBPIX and _CONTOUR have
# none. Documented for neither; OpenCV's page only calls it an "AprilTag 2 approach".
# Why it matters: half a pixel at 0.5 m and f = 600 px is 0.4 mm, the same in every picture, so that averaging hides
# it; in a stereo pair with two detectors it becomes depth.
# Instead: subtract 0.5 from AprilTag's corners before OpenCV; in OpenCV refine with CORNER_REFINE_SUBPIX.
#
# Tags are drawn with 16 x 16 samples a pixel at known corners, pixel centres at whole numbers.
#
# Seen:
#   pupil-apriltags            mean offset x +0.48 px, y +0.50 px
#   OpenCV, refined APRILTAG   mean offset x +0.43 px, y +0.42 px
#   OpenCV, refined SUBPIX     mean offset x -0.00 px, y -0.01 px
#   OpenCV, refined CONTOUR    mean offset x -0.00 px, y -0.00 px
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet pupil-apriltags==1.0.4.post11 opencv-python-headless==5.0.0.93 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import cv2
import numpy as np
import pupil_apriltags

SAMPLES, SIZE = 16, 160.0
HEIGHT, WIDTH = 300, 340
aruco = cv2.aruco
dictionary = aruco.getPredefinedDictionary(aruco.DICT_APRILTAG_36h11)
bits = aruco.generateImageMarker(dictionary, 0, 8, borderBits=1)


def draw(x0, y0, angle):
    """A picture of the tag, and its four corners in pixels (pixel centres at whole numbers)."""
    y, x = (np.mgrid[0 : HEIGHT * SAMPLES, 0 : WIDTH * SAMPLES] + 0.5) / SAMPLES - 0.5
    cos, sin = np.cos(angle), np.sin(angle)
    column = np.floor(8 * (cos * (x - x0) + sin * (y - y0)) / SIZE).astype(int)
    row = np.floor(8 * (-sin * (x - x0) + cos * (y - y0)) / SIZE).astype(int)
    inside = (row >= 0) & (row < 8) & (column >= 0) & (column < 8)
    grey = np.full(x.shape, 255.0, np.float32)
    grey[inside] = bits[row[inside], column[inside]]
    picture = grey.reshape(HEIGHT, SAMPLES, WIDTH, SAMPLES).mean((1, 3)).round().astype(np.uint8)
    edges = SIZE * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    return picture, edges @ np.array([[cos, sin], [-sin, cos]]) + (x0, y0)


def opencv_corners(picture, refinement):
    parameters = aruco.DetectorParameters()
    parameters.cornerRefinementMethod = refinement
    corners, _, _ = aruco.ArucoDetector(dictionary, parameters).detectMarkers(picture)
    return corners[0].reshape(4, 2)


detector = pupil_apriltags.Detector(families="tag36h11", quad_decimate=1.0)
methods = {
    "pupil-apriltags": lambda picture: detector.detect(picture)[0].corners,
    "OpenCV, refined APRILTAG": lambda picture: opencv_corners(picture, aruco.CORNER_REFINE_APRILTAG),
    "OpenCV, refined SUBPIX": lambda picture: opencv_corners(picture, aruco.CORNER_REFINE_SUBPIX),
    "OpenCV, refined CONTOUR": lambda picture: opencv_corners(picture, aruco.CORNER_REFINE_CONTOUR),
}
scenes = [draw(110.0, 50.0, 0.3), draw(101.37, 48.81, 0.2), draw(120.2, 40.6, 0.5)]
offset = {}
for name, find in methods.items():
    errors = []
    for picture, true in scenes:
        found = find(picture)
        nearest = [found[np.linalg.norm(found - corner, axis=1).argmin()] for corner in true]
        errors.append((np.array(nearest) - true).mean(0))
    offset[name] = np.mean(errors, 0)
    print(f"{name:26s} mean offset x {offset[name][0]:+.2f} px, y {offset[name][1]:+.2f} px")
shifted = [offset["pupil-apriltags"], offset["OpenCV, refined APRILTAG"]]
straight = [offset["OpenCV, refined SUBPIX"], offset["OpenCV, refined CONTOUR"]]
if np.min(shifted) < 0.35 or np.abs(straight).max() > 0.1:
    raise SystemExit("changed: the offsets are no longer half a pixel against none")
PYTHON
