#!/usr/bin/env bash
# python-can 4.6.1: an .asc log that begins in the first tenth of a second is up to 0.9 s late
#
# Expected: a log written by `ASCWriter` and read by `ASCReader(relative_timestamp=False)` has the time stamps that it
# was given, to the millisecond of its header, whenever it begins.
# What happens: the writer puts the milliseconds behind the point without leading zeros: 12:00:00.042 becomes
# "12:00:00.42", which the reader (and anyone) takes for 420 ms. Logs that begin 1 to 99 ms after a full second, one
# in ten, are late as a whole, by up to 0.89 s. Formats .blf, .trc and .log of the same package keep it. No warning.
# Why it matters: forces and clamp positions from CAN are laid over pictures by absolute time.
# Instead: .blf or .log; or take times relative to a first frame that both records have.
#
# Seen:
#   start at 12:00:00.001: .asc +0.099 s, .blf +0.000 s, .trc +0.000 s, .log +0.000 s
#   start at 12:00:00.009: .asc +0.891 s, .blf +0.000 s, .trc +0.000 s, .log +0.000 s
#   start at 12:00:00.042: .asc +0.378 s, .blf +0.000 s, .trc +0.000 s, .log +0.000 s
#   start at 12:00:00.099: .asc +0.891 s, .blf +0.000 s, .trc +0.000 s, .log +0.000 s
#   start at 12:00:00.100: .asc +0.000 s, .blf +0.000 s, .trc +0.000 s, .log +0.000 s
#   start at 12:00:00.742: .asc +0.000 s, .blf +0.000 s, .trc +0.000 s, .log +0.000 s
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet python-can==4.6.1

TZ=UTC venv/bin/python - <<'PYTHON'
import can

NOON_S = 1_767_268_800  # 2026-01-01 12:00:00 UTC
FORMATS = {"asc": {"relative_timestamp": False}, "blf": {}, "trc": {}, "log": {}}


def late_s(suffix, start_s):
    """Shift of the frames, written and read by python-can, one second of ten frames."""
    path = f"trial-{start_s % 1:.3f}.{suffix}"
    given_s = [start_s + frame / 10 for frame in range(10)]
    with can.Logger(path) as log:
        for time_s in given_s:
            log(can.Message(timestamp=time_s, arbitration_id=0x123, data=[1, 2], is_extended_id=False))
    with can.LogReader(path, **FORMATS[suffix]) as reader:
        shifts = [message.timestamp - time_s for message, time_s in zip(reader, given_s, strict=True)]
    assert max(shifts) - min(shifts) < 1e-3
    return shifts[0]


seen = {}
for milliseconds in (1, 9, 42, 99, 100, 742):
    seen[milliseconds] = {suffix: late_s(suffix, NOON_S + milliseconds / 1000) for suffix in FORMATS}
    shifts = ", ".join(f".{suffix} {shift:+.3f} s" for suffix, shift in seen[milliseconds].items())
    print(f"start at 12:00:00.{milliseconds:03d}: {shifts}")
if abs(seen[42].pop("asc") - 0.378) > 2e-3 or abs(seen[9].pop("asc") - 0.891) > 2e-3:
    raise SystemExit("changed: the start of .asc logs has its milliseconds in their places")
if max(abs(shift) for milliseconds in (9, 42, 100, 742) for shift in seen[milliseconds].values()) > 2e-3:
    raise SystemExit("changed: the other formats, or other starts, are late too")
PYTHON
