#!/usr/bin/env bash
# scikit-surgerycore 0.8.3: the target registration error depends on where the origin of the frame is
#
# Expected: `compute_tre_from_fle(fiducials, fle2, target)` is equation 46 of Fitzpatrick, West and Maurer 1998, as its
# docstring says: distances from the principal axes of the fiducials. It is the same in every frame.
# What happens: two slips. It takes rows of the matrix of eigenvectors for the axes (they are its columns), and gives
# the vector where its function for distances wants a second point of the line. Neither shows if the centroid is the
# origin and the axes lie along the frame or at 45 deg to it, as in its tests. Otherwise the number is one of the
# frame, not of the registration.
# Why it matters: the expected error at the target decides whether a registration of phantom or organ to the robot is
# good enough; coordinates in the robot's base frame, far from the origin, are the usual case.
# Instead: write the sum yourself (as below), or simulate the registration.
#
# Four fiducials in a strip of 113 mm, target 77 mm from their centre, FLE 0.5 mm (RMS); simulated: 20 000 rigid
# registrations to noisy fiducials.
#
# Seen:
#   origin in the first fiducial  package 1.77 mm, formula 1.11, simulated 1.10
#   origin 600 mm away in x       package 0.63 mm, formula 1.11, simulated 1.10
#   turned by 30 deg about z      package 1.77 mm, formula 1.11, simulated 1.11
#   origin in the centroid        package 0.96 mm, formula 1.11, simulated 1.10
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet scikit-surgerycore==0.8.3 numpy==2.4.6

venv/bin/python - <<'PYTHON'
import numpy as np
from sksurgerycore.algorithms.errors import compute_tre_from_fle

FLE_MM = 0.5
FIDUCIALS_MM = np.array([[0.0, 0, 0], [80, 80, 0], [25, 45, 5], [60, 40, 10]])
TARGET_MM = np.array([[90.0, 0, -40]])
angle = np.radians(30)
ABOUT_Z = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])


def by_formula(fiducials, target):
    """Equation 46: FLE^2 / N (1 + sum over the principal axes of (d_k / f_k)^2 / 3), square root of it."""
    from_centre = fiducials - fiducials.mean(0)
    axes = np.linalg.eigh(from_centre.T @ from_centre)[1].T
    beside = target[0] - fiducials.mean(0)
    ratio = 0.0
    for axis in axes:
        f2 = np.mean((from_centre**2).sum(1) - (from_centre @ axis) ** 2)
        ratio += (beside @ beside - (beside @ axis) ** 2) / f2
    return float(np.sqrt(FLE_MM**2 / len(fiducials) * (1 + ratio / 3)))


def simulated(fiducials, target, trials=20_000):
    """RMS distance of the target after rigid least-squares registration (Arun) to noisy fiducials."""
    noise = np.random.default_rng(0).normal(scale=FLE_MM / np.sqrt(3), size=(trials, *fiducials.shape))
    seen = fiducials + noise
    centre, seen_centre = fiducials.mean(0), seen.mean(1)
    u, _, vt = np.linalg.svd(np.einsum("ni,tnj->tij", fiducials - centre, seen - seen_centre[:, None]))
    flip = np.ones((trials, 3))
    flip[:, 2] = np.linalg.det(u @ vt)
    rotation = np.einsum("tji,tj,tkj->tik", vt, flip, u)
    moved = np.einsum("tij,j->ti", rotation, target[0] - centre) + seen_centre
    return float(np.sqrt(((moved - target[0]) ** 2).sum(1).mean()))


frames = {
    "origin in the first fiducial": (FIDUCIALS_MM, TARGET_MM),
    "origin 600 mm away in x": (FIDUCIALS_MM + [600, 0, 0], TARGET_MM + [600, 0, 0]),
    "turned by 30 deg about z": (FIDUCIALS_MM @ ABOUT_Z.T, TARGET_MM @ ABOUT_Z.T),
    "origin in the centroid": (FIDUCIALS_MM - FIDUCIALS_MM.mean(0), TARGET_MM - FIDUCIALS_MM.mean(0)),
}
package, formula = [], []
for name, (fiducials, target) in frames.items():
    package.append(float(np.sqrt(compute_tre_from_fle(fiducials, FLE_MM**2, target))))
    formula.append(by_formula(fiducials, target))
    simulation = simulated(fiducials, target)
    print(f"{name:29s} package {package[-1]:.2f} mm, formula {formula[-1]:.2f}, simulated {simulation:.2f}")
if np.allclose(package, formula, rtol=0.02):
    raise SystemExit("changed: the package follows the formula in every frame")
if np.ptp(package) < 0.05:
    raise SystemExit("changed: the package gives one number in every frame")
PYTHON
