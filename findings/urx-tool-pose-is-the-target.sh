#!/usr/bin/env bash
# urx 0.11.0: the tool pose of the real-time monitor is the commanded one
#
# Expected: `URRTMonitor.tcf_pose()` ("Return the tool pose values"), beside `q_actual()` and `tcf_force()`, is where
# the tool is, and fits the actual joint angles that come with it in `get_all_data()`.
# What happens: the monitor reads the packet of port 30003 as controllers of the CB2 series sent it, where the only
# "tool vector" stood after the force. Since software 3.0 (CB3, e-Series) that place holds "Tool vector target", and the
# actual pose has moved forward, in front of the force. The fields before and the force are where they were, the packet
# is longer and its end is ignored, so nothing looks wrong.
# Documented: the manufacturer's table of the interface, per software version.
# Why it matters: pose and force are recorded together to get a stiffness. The commanded pose hides the lag of the arm
# and all its compliance, and the buffered data pair it with actual joint angles.
# Instead: forward kinematics of `q_actual()`, or RTDE's actual_TCP_pose.
#
# An emulated controller sends packets of software 5.1 (1116 bytes): an arm that has stopped 3 mm short of its target,
# pushing with 6 N.
#
# Seen:
#   packet of 1116 bytes, tool height reached 0.203 m, commanded 0.200 m
#   tcf_pose() 0.200 m, with joint angles 0.51 rad (actual 0.51)
#   tcf_force() 6.0 N
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet urx==0.11.0 math3d==4.0.0 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import socket
import struct
import threading
import time

import numpy as np
from urx.urrtmon import URRTMonitor

REACHED_M, COMMANDED_M, FORCE_N = 0.203, 0.200, 6.0
ACTUAL_RAD, TARGET_RAD = 0.51, 0.50
#: Number of doubles of each field of the real-time client interface, software 5.1.
FIELDS = {
    "time": 1, "q target": 6, "qd target": 6, "qdd target": 6, "I target": 6, "M target": 6, "q actual": 6,
    "qd actual": 6, "I actual": 6, "I control": 6, "tool vector actual": 6, "TCP speed actual": 6, "TCP force": 6,
    "tool vector target": 6, "TCP speed target": 6, "digital inputs": 1, "motor temperatures": 6,
    "controller timer": 1, "test value": 1, "robot mode": 1, "joint modes": 6, "safety mode": 1, "reserved 1": 6,
    "tool accelerometer": 3, "reserved 2": 6, "speed scaling": 1, "linear momentum norm": 1, "reserved 3": 2,
    "V main": 1, "V robot": 1, "I robot": 1, "V actual": 6, "digital outputs": 1, "program state": 1,
    "elbow position": 3, "elbow velocity": 3, "safety status": 1,
}


def packet(time_s):
    values = {name: [0.0] * count for name, count in FIELDS.items()}
    values["time"] = [time_s]
    values["q target"], values["q actual"] = [TARGET_RAD] * 6, [ACTUAL_RAD] * 6
    values["tool vector actual"][2], values["tool vector target"][2] = REACHED_M, COMMANDED_M
    values["TCP force"][2] = FORCE_N
    numbers = [number for field in values.values() for number in field]
    return struct.pack(f">i{len(numbers)}d", 4 + 8 * len(numbers), *numbers)


def controller(listener):
    connection, _ = listener.accept()
    with connection:
        for index in range(500):
            try:
                connection.sendall(packet(100 + index * 0.002))
            except OSError:
                return
            time.sleep(0.002)


with socket.create_server(("127.0.0.1", 30003)) as listener:
    threading.Thread(target=controller, args=(listener,), daemon=True).start()
    monitor = URRTMonitor("127.0.0.1")
    monitor.start()
    monitor.wait()
    seen = monitor.get_all_data(wait=False)
    monitor.close()

height_m = seen["tcp"][2]
print(f"packet of {len(packet(0))} bytes, tool height reached {REACHED_M:.3f} m, commanded {COMMANDED_M:.3f} m")
print(f"tcf_pose() {height_m:.3f} m, with joint angles {seen['qActual'][0]:.2f} rad (actual {ACTUAL_RAD:.2f})")
print(f"tcf_force() {seen['tcp_force'][2]:.1f} N")
if not (np.allclose(seen["qActual"], ACTUAL_RAD) and seen["tcp_force"][2] == FORCE_N):
    raise SystemExit("changed: joint angles or force are read from elsewhere")
if height_m != COMMANDED_M:
    raise SystemExit(f"changed: the pose is no longer the commanded one, {height_m} m")
PYTHON
