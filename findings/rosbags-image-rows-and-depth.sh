#!/usr/bin/env bash
# rosbags-image 0.10.4: padded rows come out slanted, and compressed depth in 8 bits
#
# Expected: `message_to_cvimage` gives the picture that is in the message: rows begin `step` bytes apart (sensor_msgs/
# Image: "full row length in bytes"), and a 16-bit PNG in sensor_msgs/CompressedImage has 16 bits.
# What happens: `step` is not looked at. Rows of a camera that pads them (642 pixels in 644 bytes) are taken as if
# they followed each other: every row is shifted by the padding of all rows above it, and the lower end is lost. The
# PNG is decoded to 8 bits: of a depth in mm the upper byte is left, steps of 256 mm. Neither warns.
# Why it matters: a batch of recordings runs through, and tracked points, and strains from them, are those of another
# picture (V4L2 cameras pad rows). Depth of 0.3 to 0.6 m has two values left.
# Instead: `numpy.ndarray((height, width), dtype, data, strides=(step, size of a pixel))`; `cv2.imdecode` with
# IMREAD_UNCHANGED.
#
# Seen:
#   upright line at column 100: in row 0 at 100, in row 40 at 180, in row 240 at 580
#   depth 1234 mm: read 4 as uint8
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet rosbags-image==0.10.4 rosbags==0.11.9 opencv-python-headless==5.0.0.93 numpy==2.4.6

venv/bin/python - <<'PYTHON'
from pathlib import Path

import cv2
import numpy as np
from rosbags.image import message_to_cvimage
from rosbags.rosbag2 import Reader, Writer
from rosbags.typesys import Stores, get_typestore

store = get_typestore(Stores.ROS2_JAZZY)
types = store.types
header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), "camera")
HEIGHT, WIDTH, STEP, COLUMN = 480, 642, 644, 100
DEPTH_MM = 1234

rows = np.zeros((HEIGHT, STEP), np.uint8)
rows[:, COLUMN] = 255  # an upright line
upright = types["sensor_msgs/msg/Image"](header, HEIGHT, WIDTH, "mono8", 0, STEP, rows.ravel())
png = cv2.imencode(".png", np.full((HEIGHT, WIDTH), DEPTH_MM, np.uint16))[1].ravel()
depth = types["sensor_msgs/msg/CompressedImage"](header, "16UC1; png compressed ", png)

with Writer(Path("trial"), version=9) as bag:
    for topic, message in (("/image", upright), ("/depth", depth)):
        kind = message.__msgtype__
        bag.write(bag.add_connection(topic, kind, typestore=store), 0, store.serialize_cdr(message, kind))
with Reader(Path("trial")) as bag:
    read = {of.topic: message_to_cvimage(store.deserialize_cdr(raw, of.msgtype)) for of, _, raw in bag.messages()}

line = read["/image"].argmax(1)
print(f"upright line at column {COLUMN}: in row 0 at {line[0]}, in row 40 at {line[40]}, in row 240 at {line[240]}")
print(f"depth {DEPTH_MM} mm: read {read['/depth'].max()} as {read['/depth'].dtype}")
if line[240] == COLUMN:
    raise SystemExit("changed: the rows are taken from step")
if read["/depth"].dtype != np.uint8:
    raise SystemExit("changed: 16-bit PNG stays 16-bit")
PYTHON
