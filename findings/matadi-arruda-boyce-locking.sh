#!/usr/bin/env bash
# matadi 0.5.0: the Arruda-Boyce law locks at the square of the stretch that was given
#
# Expected: `arruda_boyce(F, C1, limit)` is the five-term series C1 sum a_i / limit^(2 (i - 1)) (I1^i - 3^i) with the
# locking stretch of the chains as limit, as in FElupe, a package of the same author, under the same name.
# What happens: the powers are 4 (i - 1): beta = 1 / limit^2 is squared once more. The chains lock at limit^2; a law
# with limit 1.5 stiffens like one with 2.25. The initial shear modulus changes as well. The form of the curve is right,
# so a fit is as good as ever, and returns the square root of the locking stretch.
# Documented: by a link to the encyclopaedia page of the model, which has the usual powers.
# Why it matters: a parameter fitted with matadi and used in FElupe, or in a finite element program, gives a tissue
# that locks far too early; one from the literature used in matadi is too soft at large stretch.
# Instead: give sqrt(limit), and square what a fit returns.
#
# Nominal stress of an incompressible uniaxial test, C1 = 1 kPa, limit 1.5.
#
# Seen:
#   stretch                  1.1    1.5    2.0    2.5
#   series, limit 1.5       0.40   1.70   3.82   8.55 kPa
#   felupe, limit 1.5       0.40   1.70   3.82   8.55 kPa
#   matadi, limit 1.5       0.31   1.25   2.25   3.48 kPa
#   series, limit 2.25      0.31   1.25   2.25   3.48 kPa
#   matadi, limit 1.2247    0.40   1.70   3.82   8.55 kPa
#   fitted with matadi to the series: C1 1.00 kPa, limit 1.22
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet matadi==0.5.0 casadi==3.8.2 felupe==11.3.0 tensortrax==0.29.0 \
    matplotlib==3.11.2 numpy==2.4.6 scipy==1.17.1

venv/bin/python - <<'PYTHON'
import felupe
import matadi
import numpy as np
from scipy.optimize import least_squares

C1_KPA, LIMIT = 1.0, 1.5
STRETCHES = np.array([1.1, 1.5, 2.0, 2.5])
TERMS = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)


def nominal_kpa(gradient):
    """Axial stress of an incompressible uniaxial test; the pressure makes the sides free."""
    stresses = []
    for stretch in STRETCHES:
        F = np.diag([stretch, stretch**-0.5, stretch**-0.5])
        P = gradient(F[:, :, None, None])[:, :, 0, 0]
        stresses.append(P[0, 0] - P[1, 1] * F[1, 1] / F[0, 0])
    return np.array(stresses)


def by_matadi(c1_kpa, limit):
    material = matadi.MaterialHyperelastic(matadi.models.arruda_boyce, C1=c1_kpa, limit=limit)
    return nominal_kpa(lambda F: material.gradient([F])[0])


def by_felupe(c1_kpa, limit):
    material = felupe.Hyperelastic(felupe.arruda_boyce, C1=c1_kpa, limit=limit)
    return nominal_kpa(lambda F: material.gradient([F, None])[0])


def by_series(c1_kpa, limit):
    first = STRETCHES**2 + 2 / STRETCHES
    slope = sum((i + 1) * a * (first / limit**2) ** i for i, a in enumerate(TERMS))
    return 2 * c1_kpa * slope * (STRETCHES - STRETCHES**-2)


series, other, got = (law(C1_KPA, LIMIT) for law in (by_series, by_felupe, by_matadi))
print("stretch               " + " ".join(f"{stretch:6.1f}" for stretch in STRETCHES))
for name, stress in {
    "series, limit 1.5": series,
    "felupe, limit 1.5": other,
    "matadi, limit 1.5": got,
    "series, limit 2.25": by_series(C1_KPA, LIMIT**2),
    "matadi, limit 1.2247": by_matadi(C1_KPA, LIMIT**0.5),
}.items():
    print(f"{name:22s}" + " ".join(f"{value:6.2f}" for value in stress) + " kPa")

fit = least_squares(lambda given: by_matadi(*given) - series, (0.5, 2.0), bounds=((0.01, 1.05), (10, 10)))
print("fitted with matadi to the series: C1 {:.2f} kPa, limit {:.2f}".format(*fit.x))
if np.allclose(got, series):
    raise SystemExit("changed: the law locks at the stretch that was given")
if not (np.allclose(other, series) and np.allclose(got, by_series(C1_KPA, LIMIT**2))):
    raise SystemExit("changed: the law is neither that of the stretch given nor that of its square")
PYTHON
