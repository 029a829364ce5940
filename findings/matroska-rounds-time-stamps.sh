#!/usr/bin/env bash
# PyAV 18.1.0 (FFmpeg): a .mkv keeps time stamps to 1 ms only
#
# Expected: a container for lossless recordings with stamps for each frame keeps them as given; PyAV takes a
# `time_base` for the stream and says nothing.
# What happens: Matroska counts in TimestampScale, by default 1 ms, and FFmpeg writes that; the stream's time base
# is replaced. At 240 frames a second the steps are 4, 4 and 5 ms. The same frames in .mp4 or .nut keep their
# stamps.
# Why it matters: velocities from tracked markers from single steps are up to 17 % low, and camera against force is
# off by half a millisecond.
# Instead: .mp4 or .nut, or a table of stamps beside the film.
#
# Seen:
#   film.mkv: largest error 0.500 ms, steps [4.0, 5.0] ms
#   film.nut: largest error 0.000 ms, steps [4.167] ms
#   film.mp4: largest error 0.000 ms, steps [4.167] ms
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet av==18.1.0 numpy==2.4.6

venv/bin/python - <<'PYTHON'
from fractions import Fraction

import av
import numpy as np

TICK = Fraction(1, 240)


def stamps_read_back(path, codec):
    with av.open(path, "w") as film:
        stream = film.add_stream(codec, rate=240)
        stream.width, stream.height, stream.pix_fmt, stream.time_base = 64, 48, "yuv420p", TICK
        for number in range(60):
            frame = av.VideoFrame.from_ndarray(np.full((48, 64, 3), 4 * number, np.uint8), format="rgb24")
            frame.pts, frame.time_base = number, TICK
            film.mux(stream.encode(frame))
        film.mux(stream.encode())
    with av.open(path) as film:
        return np.array([float(frame.pts * frame.time_base) for frame in film.decode(video=0)])


true = np.arange(60) / 240
errors = {}
for path, codec in (("film.mkv", "ffv1"), ("film.nut", "ffv1"), ("film.mp4", "mpeg4")):
    stamps = stamps_read_back(path, codec)
    errors[path] = 1e3 * np.abs(stamps - true).max()
    steps = sorted({round(1e3 * float(step), 3) for step in np.diff(stamps)})
    print(f"{path}: largest error {errors[path]:.3f} ms, steps {steps} ms")
if errors["film.mkv"] < 0.3 or max(errors["film.nut"], errors["film.mp4"]) > 0.01:
    raise SystemExit("changed: Matroska keeps the stamps, or the others do not")
PYTHON
