#!/usr/bin/env bash
# CalculiX 2.20 (Debian calculix-ccx): one run, two orders of the shear components, and a constant stress that is
# not constant
#
# Expected: one solver writes a symmetric tensor in one order, and a homogeneous state of stress in one linear brick
# reads the same everywhere.
# What happens: `*EL PRINT` (.dat) writes sxx syy szz sxy sxz syz, `*EL FILE` (.frd) writes SXX SYY SZZ SXY SYZ SZX:
# the last two change places. Both are headed so, and the manual shows both, pages apart. And the .frd holds 0.99996
# times the stress: the weights that carry the values from the points to the nodes of a C3D8 do not sum to one.
# Why it matters: comparing components of a sheared block with another solver, or reading both files with one table;
# a patch test on .frd values fails at 4e-5 for a solution that is exact.
# Instead: read the component names of the .frd, compare invariants too, and test against .dat.
#
# A unit cube, E = 1000, nu = 0, with all displacements given: sxy = 1, sxz = 2, syz = 3.
#
# Seen:
#   .dat sxx 0 syy 0 szz 0 sxy 1 sxz 2 syz 3
#   .frd SXX 0 SYY 0 SZZ 0 SXY 0.99996 SYZ 2.99988 SZX 1.99992
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
if ! dpkg-query --show calculix-ccx >/dev/null 2>&1; then
    echo "needs Debian's calculix-ccx (seen with 2.20): apt-get install calculix-ccx" >&2
    exit 2
fi
case $(dpkg-query --show --showformat='${Version}' calculix-ccx) in
2.20-*) ;;
*) echo "changed: calculix-ccx is not 2.20" >&2; exit 1 ;;
esac

cat > cube.inp <<'INPUT'
*NODE, NSET=ALL
1,0,0,0
2,1,0,0
3,1,1,0
4,0,1,0
5,0,0,1
6,1,0,1
7,1,1,1
8,0,1,1
*ELEMENT, TYPE=C3D8, ELSET=CUBE
1,1,2,3,4,5,6,7,8
*MATERIAL, NAME=TISSUE
*ELASTIC
1000.,0.
*SOLID SECTION, ELSET=CUBE, MATERIAL=TISSUE
*STEP
*STATIC
*BOUNDARY
INPUT
python3 - >>cube.inp <<'PYTHON'
corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
for node, (x, y, z) in enumerate(corners, start=1):
    displacement = (0.001 * y + 0.002 * z, 0.001 * x + 0.003 * z, 0.002 * x + 0.003 * y)
    for axis, value in enumerate(displacement, start=1):
        print(f"{node},{axis},{axis},{value}")
PYTHON
cat >>cube.inp <<'INPUT'
*EL PRINT, ELSET=CUBE
S
*EL FILE
S
*END STEP
INPUT
ccx -i cube >/dev/null
python3 - <<'PYTHON'
from pathlib import Path

dat = Path("cube.dat").read_text().splitlines()
names = next(line for line in dat if "stresses" in line).split("(")[1].split(")")[0].split(",")[2:]
first = next(line for line in dat if line.split()[:2] == ["1", "1"])
in_dat = dict(zip(names, map(float, first.split()[2:]), strict=True))

frd = Path("cube.frd").read_text().splitlines()
start = next(i for i, line in enumerate(frd) if line.startswith(" -4  STRESS"))
frd_names = [line.split()[1] for line in frd[start + 1 : start + 7]]
row = frd[start + 7][13:]
in_frd = dict(zip(frd_names, (float(row[i : i + 12]) for i in range(0, 72, 12)), strict=True))

print(".dat", *(f"{name} {round(value, 6) + 0.0:g}" for name, value in in_dat.items()))
print(".frd", *(f"{name} {round(value, 6) + 0.0:g}" for name, value in in_frd.items()))
if list(in_dat)[4:] != ["sxz", "syz"] or list(in_frd)[4:] != ["SYZ", "SZX"]:
    raise SystemExit("changed: .dat and .frd have other orders")
if abs(in_dat["sxy"] - 1) > 1e-6 or abs(in_frd["SXY"] - 0.99996) > 1e-6:
    raise SystemExit("changed: the constant stress at the nodes")
PYTHON
