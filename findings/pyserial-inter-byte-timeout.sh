#!/usr/bin/env bash
# pyserial 3.5 on Linux: inter_byte_timeout does nothing
#
# Expected: `Serial(timeout=2, inter_byte_timeout=0.02)` ends `read(100)` 20 ms after the last byte of a frame, as
# the "inter-character timeout" of its API page.
# What happens: it returns after the full 2 s. The value goes into VTIME, which the kernel ignores here because the
# port is opened non-blocking and read after `select`; `read` itself never looks at it. The setting is accepted
# without a word.
# Why it matters: frames of a load cell or gauge without an end mark are read seconds late, stamped late, and run
# into the next one.
# Instead: read what is there (`read(in_waiting or 1)`) and time the pause yourself.
#
# The other end is a pseudo-terminal; the code of `read` is the same for a real port.
#
# Seen:
#   10 bytes sent after 0.1 s, returned after 2.0 s
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet pyserial==3.5

venv/bin/python - <<'PYTHON'
import os
import pty
import threading
import time
import tty

import serial

instrument, line = pty.openpty()
tty.setraw(instrument)
tty.setraw(line)
port = serial.Serial(os.ttyname(line), 115200, timeout=2, inter_byte_timeout=0.02)
threading.Timer(0.1, os.write, (instrument, b"+0012.34 N")).start()
began = time.monotonic()
frame = port.read(100)
took = time.monotonic() - began
print(f"{len(frame)} bytes sent after 0.1 s, returned after {took:.1f} s")
if took < 1.5:
    raise SystemExit("changed: inter_byte_timeout ends the read")
PYTHON
