#!/usr/bin/env bash
# pyrealsense2 2.59.1.11053: what the distortion models really do
#
# Expected: `rs2_deproject_pixel_to_point` undoes `rs2_project_point_to_pixel` for every model, and, by the comment
# in rs_types.h, `inverse_brown_conrady` applies the polynomial from the distorted to the undistorted point.
# What happens: with `modified_brown_conrady` the ray is returned without any correction, silently: there and back
# is several pixels off. With `inverse_brown_conrady` the coefficients are used forwards and inverted by iteration:
# the ray is that of OpenCV's `undistortPoints` for the plain model, not the one that the comment describes.
# Why it matters: colour streams of RealSense cameras report these models; a hand-written undistortion after the
# header is wrong by 3 % of the ray near the picture's edge.
# Instead: test there and back once for the model of your stream; give the coefficients to OpenCV as its forward
# model.
#
# Needs Debian's libusb-1.0-0 (any version; the wheel links to it), no camera.
#
# Seen:
#   OpenCV, forward model       x/z 0.4604  y/z 0.3448
#   inverse model by the header x/z 0.4729  y/z 0.3552
#   brown_conrady               x/z 0.4604  y/z 0.3448  there and back 0.00 px
#   modified_brown_conrady      x/z 0.4667  y/z 0.3500  there and back 4.88 px
#   inverse_brown_conrady       x/z 0.4604  y/z 0.3448  there and back 0.00 px
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
if ! dpkg-query --show libusb-1.0-0 >/dev/null 2>&1; then
    echo "needs Debian's libusb-1.0-0: apt-get install libusb-1.0-0" >&2
    exit 2
fi
python3 -m venv venv
venv/bin/pip install --quiet pyrealsense2==2.59.1.11053 opencv-python-headless==5.0.0.93 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import cv2
import numpy as np
import pyrealsense2 as rs

COEFFICIENTS = [0.12, -0.25, 0.001, -0.0007, 0.05]
PIXEL = [600.0, 450.0]
CAMERA = np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]])


def there_and_back(model):
    camera = rs.intrinsics()
    camera.width, camera.height = 640, 480
    camera.ppx, camera.ppy, camera.fx, camera.fy = 320, 240, 600, 600
    camera.model, camera.coeffs = model, COEFFICIENTS
    ray = rs.rs2_deproject_pixel_to_point(camera, PIXEL, 1.0)
    back = rs.rs2_project_point_to_pixel(camera, ray)
    return np.array(ray[:2]), float(np.hypot(*np.subtract(back, PIXEL)))


def inverse_by_the_header(x, y):
    """The polynomial applied to the distorted point."""
    k1, k2, p1, p2, k3 = COEFFICIENTS
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    return np.array(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y * y),
        ]
    )


forward = cv2.undistortPoints(np.array([[PIXEL]]), CAMERA, np.array(COEFFICIENTS)).ravel()
by_header = inverse_by_the_header((600 - 320) / 600, (450 - 240) / 600)
print(f"OpenCV, forward model       x/z {forward[0]:.4f}  y/z {forward[1]:.4f}")
print(f"inverse model by the header x/z {by_header[0]:.4f}  y/z {by_header[1]:.4f}")
rays, errors = {}, {}
for name in ("brown_conrady", "modified_brown_conrady", "inverse_brown_conrady"):
    rays[name], errors[name] = there_and_back(getattr(rs.distortion, name))
    print(f"{name:27s} x/z {rays[name][0]:.4f}  y/z {rays[name][1]:.4f}  there and back {errors[name]:.2f} px")
if errors["modified_brown_conrady"] < 1 or errors["brown_conrady"] > 0.01:
    raise SystemExit("changed: modified_brown_conrady goes there and back")
if np.abs(rays["inverse_brown_conrady"] - forward).max() > 1e-4:
    raise SystemExit("changed: inverse_brown_conrady is no longer the forward model")
PYTHON
