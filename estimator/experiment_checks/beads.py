"""Beads in the rows before any motion, against where they are stated to be; and how they move with what holds them."""

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from estimator.experiment.holds import FloatArray
from estimator.experiment.model import Experiment
from estimator.experiment_checks.finding import Finding, of_facts, of_rows
from estimator.experiment_checks.readings import SURELY, at_rest, longest_edge, travel

_LEAST_FOR_A_POSE = 3
_MOSTLY = 0.5


def check_rest(experiment: Experiment) -> list[Finding]:
    """Before any motion the beads are where [fiducials] rest says, up to noise.

    What differs is told apart by the motion that explains it: beads that are swapped, a frame that is mirrored, one
    that is displaced or turned as a whole, or single beads.
    """
    seen, noise = _seen_at_rest(experiment)
    rest = experiment.fiducials_rest
    known = np.isfinite(seen)
    if not known.any():
        return []
    off = np.where(known, seen - rest, 0.0)
    # a millimetre of resolution in [fiducials] rest is no error of the frame
    limit = np.maximum(SURELY * noise, 2e-3 * longest_edge(experiment))
    if not np.any(np.abs(off) > limit):
        return []
    return (
        _swapped(seen, rest, limit, known)
        or _mirrored(seen, rest, limit, known)
        or _moved_as_a_whole(seen, rest, limit, known)
        or _single(off, limit)
    )


def check_held_beads(experiment: Experiment) -> list[Finding]:
    """A bead in an anchor stands still while the gripper moves."""
    anchored = np.zeros(len(experiment.fiducials_rest), dtype=bool)
    for anchor in experiment.anchors:
        anchored |= anchor.contains(experiment.fiducials_rest)
    moves = experiment.fiducials - experiment.fiducials[0]
    known = np.isfinite(moves).any(axis=(0, 2)) & anchored
    if not known.any():
        return []
    gripper = float(np.linalg.norm(travel(experiment), axis=1).max())
    farthest = np.nanmax(np.abs(moves[:, known]), axis=(0, 2))
    worst = int(np.argmax(farthest))
    limit = SURELY * np.sqrt(2) * experiment.sensor.fiducial_std + 0.1 * gripper
    if farthest[worst] <= limit:
        return []
    bead = int(np.flatnonzero(known)[worst])
    what = f"lies in an anchor, which does not move, and moves by {farthest[worst] * 1e3:.3g} mm"
    do = "see whether the anchor slips, and whether anchors and beads are in one frame"
    return [of_rows("suspicious", "held beads", what, do, column=f"m{bead:02d}x")]


def check_common_direction(experiment: Experiment) -> list[Finding]:
    """Along the gripper's motion the beads go, as a whole, the way that the gripper goes.

    A held elastic body follows where it is pulled; beads that go the other way have an axis of the other sign.
    """
    moved = travel(experiment)
    distance = np.linalg.norm(moved, axis=1)
    row = int(np.argmax(distance))
    moves = experiment.fiducials - experiment.fiducials[0]
    if distance[row] == 0 or not np.isfinite(moves[row]).any():
        return []
    findings = []
    for axis in range(3):
        way = moved[row, axis]
        follow = moves[row, :, axis]
        follow = follow[np.isfinite(follow)]
        noise = SURELY * experiment.sensor.fiducial_std * np.sqrt(2 / max(len(follow), 1))
        if abs(way) < 0.9 * distance[row] or not len(follow):
            continue
        mean = float(follow.mean() * np.sign(way))
        if mean < -noise and mean < -0.05 * abs(way):
            what = (
                f"the beads go {-mean * 1e3:.3g} mm against the gripper, which goes {abs(way) * 1e3:.3g} mm"
            )
            do = f"check the sign of {'xyz'[axis]} in beads and positions; they are in one right-handed frame"
            findings.append(
                of_rows("suspicious", "direction of beads", what, do, row=row, column=f"m00{'xyz'[axis]}")
            )
    return findings


def _seen_at_rest(experiment: Experiment) -> tuple[FloatArray, FloatArray]:
    """Return the mean of the beads before any motion, (m, 3), and its standard deviation.

    Where the weight acts they hang elsewhere than on the phantom free of stress.
    """
    hangs = experiment.environment.weight == "acts"
    rows = experiment.fiducials[at_rest(experiment) & (not hangs)]
    count = np.isfinite(rows).sum(axis=0)
    mean = np.where(count > 0, np.nansum(rows, axis=0) / np.maximum(count, 1), np.nan)
    return mean, experiment.sensor.fiducial_std / np.sqrt(np.maximum(count, 1))


def _swapped(seen: FloatArray, rest: FloatArray, limit: FloatArray, known: np.ndarray) -> list[Finding]:
    """Beads that lie where others should, each within noise."""
    whole = known.any(axis=1)
    places = np.flatnonzero(whole)
    apart = np.where(known[whole][:, None], np.abs(seen[whole][:, None] - rest[whole][None]), 0.0)
    fits = np.asarray((apart <= limit[whole][:, None]).all(axis=2))
    pairs_from, pairs_to = linear_sum_assignment(~fits)
    if not fits[pairs_from, pairs_to].all() or (pairs_from == pairs_to).all():
        return []
    wrong = [
        (int(places[a]), int(places[b])) for a, b in zip(pairs_from, pairs_to, strict=True) if not fits[a, a]
    ]
    if not wrong:
        return []
    bead, other = wrong[0]
    what = f"lies in the first rows where m{other:02d} is at rest; {len(wrong)} beads are exchanged"
    return [of_rows("wrong", "beads at rest", what, "exchange the names", row=0, column=f"m{bead:02d}x")]


def _mirrored(seen: FloatArray, rest: FloatArray, limit: FloatArray, known: np.ndarray) -> list[Finding]:
    """Beads that fit once an axis, or two, or all, are turned over."""
    for signs, names in (
        ((-1, 1, 1), "x"), ((1, -1, 1), "y"), ((1, 1, -1), "z"),
        ((-1, -1, 1), "x and y"), ((-1, 1, -1), "x and z"), ((1, -1, -1), "y and z"), ((-1, -1, -1), "x, y and z"),
    ):  # fmt: skip
        off = np.where(known, seen * np.array(signs) - rest, 0.0)
        if np.all(np.abs(off) <= limit):
            what = f"the beads fit [fiducials] rest with the sign of {names} turned over"
            do = "express beads and rest in one right-handed frame"
            return [of_rows("wrong", "beads at rest", what, do, row=0, column="m00x")]
    return []


def _moved_as_a_whole(
    seen: FloatArray, rest: FloatArray, limit: FloatArray, known: np.ndarray
) -> list[Finding]:
    """Beads that fit after one rigid motion."""
    whole = known.all(axis=1)
    if whole.sum() < _LEAST_FOR_A_POSE:
        return []
    shift = np.median(seen[whole] - rest[whole], axis=0)
    rotation, _ = Rotation.align_vectors(
        seen[whole] - seen[whole].mean(axis=0), rest[whole] - rest[whole].mean(axis=0)
    )
    moved = rotation.apply(rest[whole] - rest[whole].mean(axis=0)) + seen[whole].mean(axis=0)
    if not np.all(np.abs(moved - seen[whole]) <= limit[whole]):
        return []
    angle = float(np.degrees(rotation.magnitude()))
    what = (
        f"before any motion the beads are off [fiducials] rest as a whole, by {np.linalg.norm(shift) * 1e3:.3g} mm"
        f" and {angle:.2g} degrees"
    )
    do = "express both in one frame, or let the first row be the one in which rest was measured"
    return [of_rows("suspicious", "beads at rest", what, do, row=0, column="m00x")]


def _single(off: FloatArray, limit: FloatArray) -> list[Finding]:
    beyond = np.abs(off) > limit
    beads = np.flatnonzero(beyond.any(axis=1))
    bead = int(np.argmax(np.abs(off).max(axis=1)))
    axis = int(np.argmax(np.abs(off[bead])))
    what = (
        f"is {off[bead, axis] * 1e3:+.3g} mm off [fiducials] rest before any motion ({len(beads)} of {len(off)} beads"
        " are off)"
    )
    if len(beads) > _MOSTLY * len(off) and len(off) >= _LEAST_FOR_A_POSE:
        do = "see whether rest and observations are of one mounting, in one frame"
        return [of_facts("suspicious", "beads at rest", f"m{bead:02d} {what}", do, "[fiducials] rest")]
    do = "correct the place of this bead, or leave its fields empty"
    return [of_rows("suspicious", "beads at rest", what, do, row=0, column=f"m{bead:02d}{'xyz'[axis]}")]
