"""Units: lengths against the body's size, forces against what soft solids bear."""

import numpy as np

from estimator.experiment.holds import FloatArray
from estimator.experiment.model import Experiment
from estimator.experiment_checks.finding import Finding, of_facts, of_rows
from estimator.experiment_checks.readings import (
    SURELY,
    body_box,
    longest_edge,
    measured_forces,
    travel,
)

_LARGEST_M = 2.0
_SMALLEST_M = 1e-5
_LENGTH_UNITS = {1e3: "mm", 1e2: "cm", 1e-3: "km", 25.4: "inches times 1000", 39.37007874: "inches"}
_UNIT_FITS = 0.1  # of the factor, in its logarithm
_STIFFEST_SOFT_PA = 5e6  # a hard rubber, Shore A 60: Gent, Rubber Chem. Technol. 31 (1958)
_SOFTEST_PA = 50.0  # brain and weak gels: Budday et al., Arch. Comput. Methods Eng. 27 (2020)
_STIFFEST_SOLID_PA = 1e9
_BENDING = 30.0  # how much softer a slender body is in bending than in tension


def check_size(experiment: Experiment) -> list[Finding]:
    """A phantom has edges of some millimetres to decimetres; in millimetres the same numbers are a building."""
    longest, shortest = longest_edge(experiment), min(abs(edge) for edge in experiment.phantom.size_m)
    key = "[phantom] size"
    if min(experiment.phantom.size_m) <= 0:
        return [of_facts("wrong", "size", "an edge is not above 0 m", "write the three edges in metres", key)]
    if longest > _LARGEST_M:
        return [
            of_facts(
                "wrong",
                "size",
                f"an edge of {longest:g} m; it would be {longest / 1e3:g} m if these are millimetres",
                "write metres",
                key,
            )
        ]
    if shortest < _SMALLEST_M:
        return [
            of_facts(
                "suspicious",
                "size",
                f"an edge of {shortest * 1e6:.3g} µm, thinner than a film",
                "write metres",
                key,
            )
        ]
    return []


def check_bead_unit(experiment: Experiment) -> list[Finding]:
    """Beads are as far apart in the first row as at rest: the ratio is 1, or that of two units; near 1 under load.

    A body that moves as a whole keeps all distances, so this holds in whatever frame the beads were measured.
    """
    ratio = _spread_ratio(experiment.fiducials[0], experiment.fiducials_rest)
    if ratio is None:
        return []
    for factor, name in _LENGTH_UNITS.items():
        if abs(np.log(ratio / factor)) < _UNIT_FITS:
            what = f"the beads are {ratio:.4g} times as far apart as [fiducials] rest says, as if in {name}"
            return [of_rows("wrong", "units of beads", what, "write metres in both", row=0, column="m00x")]
        if abs(np.log(ratio * factor)) < _UNIT_FITS:
            what = f"the beads are {1 / ratio:.4g} times as far apart as in line 2, as if in {name}"
            return [
                of_facts("wrong", "units of beads", what, "write metres in both places", "[fiducials] rest")
            ]
    if abs(ratio - 1) > 0.05 and experiment.first_row == "at_rest":
        what = f"the beads are {ratio:.4g} times as far apart as [fiducials] rest says"
        do = "compare the scale of the cameras with a ruler, and the units of both"
        return [of_rows("suspicious", "units of beads", what, do, row=0, column="m00x")]
    return []


def check_travel_unit(experiment: Experiment) -> list[Finding]:
    """The gripper stays within ten body lengths, and carries the beads about as far as it goes itself.

    Points of a body that is held elsewhere move less than where it is gripped, but for what turning and pressing
    add; ten times as far is another unit.
    """
    longest = longest_edge(experiment)
    reach = np.linalg.norm(experiment.position, axis=1)
    if reach.max() > 10 * longest:
        what = f"the gripper is {reach.max():.4g} m away, and the phantom is {longest:g} m long"
        row = int(np.argmax(reach > 10 * longest))
        return [of_rows("wrong", "units of positions", what, "write metres", row=row, column="px")]
    gripper = np.linalg.norm(travel(experiment), axis=1).max()
    moves = np.linalg.norm(experiment.fiducials - experiment.fiducials[0], axis=2)
    farthest = float(np.nanmax(moves)) if np.isfinite(moves).any() else 0.0
    noise = SURELY * max(experiment.sensor.fiducial_std, experiment.sensor.position_std, 0.0)
    turned = longest * float(np.abs(experiment.quaternion_wxyz[:, 1:]).max(initial=0.0)) * 2
    if farthest > 10 * (gripper + turned + noise) and farthest > 0.02 * longest:
        what = f"a bead moves {farthest * 1e3:.4g} mm while the gripper moves {gripper * 1e3:.4g} mm"
        row, bead = (int(place) for place in np.unravel_index(int(np.nanargmax(moves)), moves.shape))
        do = "write both in metres; if the gripper did not move, its positions are those of another stream"
        return [of_rows("wrong", "units of positions", what, do, row=row, column=f"m{bead:02d}x")]
    return []


def check_stiffness(experiment: Experiment) -> list[Finding]:
    """Force over travel tells a modulus to an order of magnitude; soft solids have one between gel and rubber.

    A bar of the body's section between anchor and grasp would need the modulus E = F L / (A u) to answer with F to the
    travel u. Slender bodies bend, and are softer by a factor of some tens: that much lower a value is allowed.
    """
    modulus = apparent_modulus(experiment)
    if modulus is None:
        return []
    axes = ", ".join("xyz"[axis] for axis in measured_forces(experiment))
    what = f"force over travel tells a modulus in the order of {modulus:.1e} Pa (measured along {axes})"
    if modulus > _STIFFEST_SOLID_PA:
        return [of_rows("wrong", "units of forces", f"{what}, no soft solid's", "write newtons", column="fx")]
    if modulus > _STIFFEST_SOFT_PA:
        do = "check that forces are in newtons, not millinewtons, and lengths in metres"
        return [of_rows("suspicious", "units of forces", f"{what}, stiffer than rubber", do, column="fx")]
    if modulus < _SOFTEST_PA / _BENDING:
        return [
            of_rows(
                "suspicious",
                "units of forces",
                f"{what}, softer than any gel",
                "check that forces are in newtons, not kilonewtons, and that the gripper held the tissue",
                column="fx",
            )
        ]
    return []


def apparent_modulus(experiment: Experiment) -> float | None:
    """Return the modulus of a bar that answers as the body does, Pa; None where force or travel is lost in noise."""
    axes = list(measured_forces(experiment))
    moved = travel(experiment)
    distance = np.linalg.norm(moved, axis=1)
    if not axes or not distance.max() > SURELY * max(experiment.sensor.position_std, 0.0):
        return None
    force = experiment.wrench[:, axes] - experiment.wrench[0, axes]
    size = np.linalg.norm(np.nan_to_num(force), axis=1)
    row = int(np.argmax(size))
    if size[row] < SURELY * experiment.sensor.force_std * np.sqrt(2) or distance[row] < 0.5 * distance.max():
        return None
    box = body_box(experiment)
    edges = np.subtract(box.upper, box.lower)
    centre = np.asarray(experiment.grasp.centre)
    held = (*experiment.anchors, *(one.box for one in experiment.directed))
    away = [float(box.distance(centre)) for box in held]
    length = max(min(away, default=0.0), float(edges.min()))
    area = float(np.prod(edges)) / max(float(edges.max()), length)
    return float(size[row] * length / (area * distance[row]))


def _spread_ratio(seen: FloatArray, rest: FloatArray) -> float | None:
    """Return how many times as far apart points are seen as they are at rest, in the axes that are measured."""
    known = np.isfinite(seen)
    axes = [axis for axis in range(3) if known[:, axis].sum() >= 2]
    if not axes:
        return None
    rows = known[:, axes].all(axis=1)
    if rows.sum() < 2:
        return None
    spread = np.linalg.norm(seen[rows][:, axes] - seen[rows][:, axes].mean(axis=0))
    before = np.linalg.norm(rest[rows][:, axes] - rest[rows][:, axes].mean(axis=0))
    return float(spread / before) if before > 0 and spread > 0 else None
