#!/usr/bin/env bash
# spatialmath-python 1.1.17 and 1.1.18: the same call gives another wrench
#
# Expected: `SE3 * SpatialForce` moves a wrench from the tool frame to the base frame (f' = R f, m' = R m + p x R
# f): the docstring says that it transforms by the pose. And a patch release does not change numbers.
# What happens: up to 1.1.17 the product is with the transpose of the adjoint (its docstring names that, as if it
# were the same): the force is turned the wrong way round. 1.1.18 takes the inverse transpose, which is right.
# Neither warns. Both have the order [f, m], against Featherstone's [m, f].
# Why it matters: forces of a wrist sensor in the base frame; results change by an update of a dependency.
# Instead: pin at least 1.1.18 and test one wrench by hand, or write the two lines of algebra yourself.
#
# Tool 0.1 m above the base, turned by 90 deg about z; a force of 10 N along the tool's x.
#
# Seen:
#   by hand       [f m] 0.0 10.0 0.0 -1.0 0.0 0.0
#   1.1.17 gives  [f m] 0.0 -10.0 0.0 -1.0 0.0 0.0
#   1.1.18 gives  [f m] 0.0 10.0 0.0 -1.0 0.0 0.0
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet spatialmath-python==1.1.17 numpy==2.2.6

cat > wrench.py <<'PYTHON'
from spatialmath import SE3, SpatialForce

T_base_tool = SE3.Trans(0, 0, 0.1) * SE3.Rz(90, unit="deg")
wrench = T_base_tool * SpatialForce([10, 0, 0, 0, 0, 0])
print(" ".join(f"{value + 0.0:.1f}" for value in wrench.A.round(6).ravel()))
PYTHON

old=$(venv/bin/python wrench.py)
venv/bin/pip install --quiet --no-deps spatialmath-python==1.1.18
new=$(venv/bin/python wrench.py)
echo "by hand       [f m] 0.0 10.0 0.0 -1.0 0.0 0.0"
echo "1.1.17 gives  [f m] $old"
echo "1.1.18 gives  [f m] $new"
if [ "$old" = "$new" ] || [ "$new" != "0.0 10.0 0.0 -1.0 0.0 0.0" ]; then
    echo "changed: 1.1.17 gives $old and 1.1.18 gives $new" >&2
    exit 1
fi
