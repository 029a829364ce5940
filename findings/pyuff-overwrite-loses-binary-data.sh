#!/usr/bin/env bash
# pyuff 2.5.8: writing binary records with "overwrite" leaves an empty file
#
# Expected: `UFF(file).write_sets(sets, "overwrite")` writes the sets to a new file (its documentation: mode is
# "add" or "overwrite"), text or binary (data set 58b).
# What happens: with binary data the writer opens the file anew for the header, for the samples and for the end,
# each time emptying it. Seven bytes remain, the closing "-1". No exception. Reading gives an empty list.
# Why it matters: the force record of a trial is gone, and one sees it only when reading it back.
# Instead: remove the old file and use the mode "add", then read the file back.
#
# Seen:
#   overwrite      7 bytes, 0 of 6000 samples read back
#   add        48922 bytes, 6000 of 6000 samples read back
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet pyuff==2.5.8 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import os

import numpy as np
import pyuff


def data_set(time_s, force_n, binary, even=1):
    return {
        "type": 58, "binary": binary, "func_type": 1, "id1": "Fz", "id4": "N", "id5": "s",
        "rsp_ent_name": "tip", "rsp_node": 1, "rsp_dir": 3, "ref_ent_name": "base", "ref_node": 1, "ref_dir": 3,
        "x": time_s, "data": force_n, "abscissa_spacing": even, "orddenom_spec_data_type": 0,
    }

time_s = np.arange(6000) / 6000.0
force_n = np.sin(2 * np.pi * time_s)
size = {}
for mode in ("overwrite", "add"):
    pyuff.UFF(f"{mode}.uff").write_sets(data_set(time_s, force_n, binary=1), mode)
    read = pyuff.UFF(f"{mode}.uff").read_sets()
    count = len(read["data"]) if isinstance(read, dict) else 0
    size[mode] = os.path.getsize(f"{mode}.uff")
    print(f"{mode:9s} {size[mode]:6d} bytes, {count} of 6000 samples read back")
if not (size["overwrite"] == 7 and size["add"] > 48_000):
    raise SystemExit("changed: overwrite keeps the binary samples")
PYTHON
