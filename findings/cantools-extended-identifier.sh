#!/usr/bin/env bash
# cantools 45.1.0 with python-can 4.6.1: an extended frame is decoded as the standard message of the same number
#
# Expected: 0x100 as an 11-bit and as a 29-bit identifier are two messages on the bus and in the DBC (there with bit
# 31 set), so `decode_message` tells them apart.
# What happens: `decode_message(message.arbitration_id, message.data)`, as the documentation shows it with
# python-can, always takes the standard message. 21.5 degC of the extended frame becomes a force of 2.15 N. No
# warning, though both are in the database. `force_extended_id=True` gives the other one, then always.
# Why it matters: one number used by a load cell and by another maker's module on the same bus mixes their values.
# Instead: pass `force_extended_id=message.is_extended_id`.
#
# Seen:
#   the extended frame: plain call {'force_N': 2.15}, with force_extended_id {'temperature_degC': 21.5}
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet cantools==45.1.0 python-can==4.6.1

venv/bin/python - <<'PYTHON'
import can
import cantools

database = cantools.database.load_string(
    """VERSION ""
BU_: CELL
BO_ 256 Load: 8 CELL
 SG_ force_N : 0|16@1- (0.01,0) [0|0] "N" CELL
BO_ 2147483904 Climate: 8 CELL
 SG_ temperature_degC : 0|16@1- (0.1,0) [0|0] "degC" CELL
""",
    "dbc",
)
extended = can.Message(arbitration_id=0x100, is_extended_id=True, data=(215).to_bytes(2, "little") + bytes(6))
plain = database.decode_message(extended.arbitration_id, extended.data)
told = database.decode_message(extended.arbitration_id, extended.data, force_extended_id=extended.is_extended_id)
print(f"the extended frame: plain call {plain}, with force_extended_id {told}")
if list(plain) != ["force_N"] or list(told) != ["temperature_degC"]:
    raise SystemExit(f"changed: the plain call gives {plain}")
PYTHON
