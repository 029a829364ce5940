#!/usr/bin/env bash
# ezc3d 1.7.2: writes nothing once SimpleITK 2.5.7 has been imported before it
#
# Expected: two libraries that have nothing to do with each other can be used in one process.
# What happens: where SimpleITK was imported first, writing a C3D file raises "TypeError: Wrong number or type of
# arguments for overloaded function 'Parameter_set'". Both are wrapped by SWIG, which keeps one table of types for all
# modules of a process: what comes second finds other types of the same name. The other order is no remedy: it seemed to
# work, but long processes with both ended by a segmentation fault.
# Why it matters: a script that registers a scan and exports markers fails by what else it imports.
# Instead: write the file in another process.
#
# Seen:
#   ezc3d alone: written
#   SimpleITK, then ezc3d: TypeError
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet ezc3d==1.7.2 SimpleITK==2.5.7 numpy==2.4.6

cat > write.py <<'PYTHON'
import importlib
import sys

for name in sys.argv[1:]:
    importlib.import_module(name)
import ezc3d
import numpy as np

capture = ezc3d.c3d()
capture["parameters"]["POINT"]["RATE"]["value"] = [100]
capture["parameters"]["POINT"]["LABELS"]["value"] = ("bead",)
capture["data"]["points"] = np.zeros((4, 1, 5))
try:
    capture.write("capture.c3d")
    print("written")
except TypeError:
    print("TypeError")
PYTHON
first=$(venv/bin/python write.py)
second=$(venv/bin/python write.py SimpleITK ezc3d)
echo "ezc3d alone: $first"
echo "SimpleITK, then ezc3d: $second"
if [ "$first" != written ] || [ "$second" != TypeError ]; then
    echo "changed: ezc3d writes beside SimpleITK, or no longer alone" >&2
    exit 1
fi
