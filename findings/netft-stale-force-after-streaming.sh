#!/usr/bin/env bash
# NetFT 2.0.1 (client of the ATI Net F/T box): old forces after streaming
#
# Expected: `getForce()` asks the box for one sample and returns that sample, as its docstring says ("Request a
# single measurement from the sensor and return it").
# What happens: `stopStreaming()` ends the reading thread first, waits 0.1 s and only then tells the box to stop.
# What the box sent meanwhile stays in the socket. Each later `getForce()` sends a request, but returns the next old
# datagram. At 1 kHz about eighty calls in a row answer with the force of before; at the 7 kHz of a real box,
# several hundred.
# Why it matters: tare, contact checks and weighings after a streamed trial are made with forces of the trial.
# Instead: make a new `Sensor` after streaming, or read until the RDT sequence number is that of the answer.
#
# The box is played by a small emulator of the RDT protocol (UDP port 49152, 36-byte records, as in the manual of
# the Net F/T).
#
# Seen:
#   getForce() answered with the force of before more than 20 times in a row
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet NetFT==2.0.1

venv/bin/python - <<'PYTHON'
import socket
import struct
import threading
import time

from NetFT import Sensor

RATE_HZ = 1000
COUNTS_BEFORE, COUNTS_AFTER = 0, 5_000_000
ANSWERS = 1000


class Box(threading.Thread):
    """Answers RDT requests: command 2 with count n sends n records (0: endless), command 0 stops."""

    def __init__(self):
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 49152))
        self.socket.settimeout(1 / RATE_HZ)
        self.counts = COUNTS_BEFORE
        self.sequence = 0

    def send(self, address):
        self.sequence += 1
        record = struct.pack("!III6i", self.sequence, self.sequence, 0, *[self.counts] * 6)
        self.socket.sendto(record, address)

    def run(self):
        streaming_to = None
        while True:
            try:
                request, address = self.socket.recvfrom(64)
                _, command, count = struct.unpack("!HHI", request)
                if command == 0:
                    streaming_to = None
                elif command == 2 and count == 0:
                    streaming_to = address
                elif command == 2:
                    for _ in range(count):
                        self.send(address)
            except TimeoutError:
                pass
            if streaming_to:
                self.send(streaming_to)


box = Box()
box.start()
sensor = Sensor("127.0.0.1")
sensor.startStreaming()
time.sleep(0.3)
sensor.stopStreaming()
time.sleep(0.1)
box.counts = COUNTS_AFTER  # from here on the load is on
stale = 0
while stale < ANSWERS and sensor.getForce()[2] == COUNTS_BEFORE:
    stale += 1
print(f"getForce() answered with the force of before {'more than 20' if stale > 20 else stale} times in a row")
if stale <= 20:
    raise SystemExit(f"changed: only {stale} old answers after stopStreaming()")
PYTHON
