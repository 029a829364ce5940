"""Where the body is held: grasp, anchors and beads lie in or on it."""

import numpy as np

from estimator.experiment.holds import Box
from estimator.experiment.model import Experiment
from estimator.experiment.support import holds_tissue, in_words, is_loose_sheet
from estimator.experiment_checks.finding import Finding, of_facts, of_rows
from estimator.experiment_checks.readings import SURELY, body_box, longest_edge

_OFF_SURFACE = 0.05  # of the longest edge: what is farther off is not of this body
_DEEP = 0.02


def check_grasp(experiment: Experiment) -> list[Finding]:
    """The grasp holds a part of the body, not all of it, and the gripper's origin is near what it holds."""
    body, grasp = body_box(experiment), experiment.grasp
    if not holds_tissue(grasp.box, body):
        return [_outside("[grasp] box", "grasp", grasp.box, body)]
    findings = []
    if _covers(grasp.box, body):
        what = "the box holds the whole phantom, so that nothing of it can deform"
        findings.append(
            of_facts("wrong", "grasp", what, "write what the gripper holds, no more", "[grasp] box")
        )
    off = float(grasp.box.distance(np.array(grasp.centre)))
    if off > longest_edge(experiment):
        what = f"the gripper's origin is {off * 1e3:.3g} mm off the box, more than the phantom is long"
        findings.append(
            of_facts("suspicious", "grasp", what, "write metres in the tissue frame", "[grasp] centre")
        )
    return findings


def check_anchors(experiment: Experiment) -> list[Finding]:
    """Something stands still, it is of the body, and it is not what the gripper holds."""
    body = body_box(experiment)
    if not (experiment.anchors or experiment.directed):
        return [
            of_facts(
                "wrong", "anchors", "none is stated", "state a box whose tissue does not move", "[[anchor]]"
            )
        ]
    findings = []
    for number, anchor in enumerate(experiment.anchors, start=1):
        key = f"[[anchor]] {number} box"
        if not holds_tissue(anchor, body):
            findings.append(_outside(key, "anchors", anchor, body))
            continue
        if anchor.overlaps_within(experiment.grasp.box, body):
            findings.append(
                of_facts("wrong", "anchors", "overlaps [grasp] box in the tissue", "part the two boxes", key)
            )
        elif _covers(anchor, body):
            findings.append(
                of_facts("wrong", "anchors", "holds the whole phantom", "write what stands still", key)
            )
    return findings


def check_sheet(experiment: Experiment) -> list[Finding]:
    """A sheet that is thin beside its size, and held by a part of it, wrinkles unless something keeps it flat."""
    stated = experiment.phantom.stays_flat
    if stated or not is_loose_sheet(experiment):
        return []
    size = sorted(experiment.phantom.size_m)
    what = f"is {size[0] * 1e3:.3g} mm thin and {size[1] * 1e3:.3g} mm wide: loose, it wrinkles under next to nothing"
    taken = "it is taken to stay in its plane; " if stated is None else ""
    do = f"{taken}if it lies on something or is drawn tight, write stays_flat = true in retraction-experiment/2"
    return [of_facts("suspicious", "sheet", what, do, "[phantom] size")]


def not_prevented(experiment: Experiment) -> list[Finding]:
    """Tell along and about which axes nothing keeps the body from moving as a whole."""
    if not experiment.grasp.slides or not (free := in_words(experiment)):
        return []
    what = f"nothing keeps the phantom from moving {', '.join(free)}: it is taken to stay in its middle"
    return [of_facts("fine", "anchors", what, "", "[[roller]]")]


def check_start(experiment: Experiment) -> list[Finding]:
    """The first row is at rest, unless stated otherwise: the gripper is at its stated centre, and not turned."""
    findings = []
    loaded = experiment.first_row == "under_load"
    off = float(np.linalg.norm(experiment.position[0] - experiment.grasp.centre))
    if off > _OFF_SURFACE * longest_edge(experiment) and not loaded:
        what = f"the gripper starts {off * 1e3:.4g} mm off [grasp] centre"
        do = "correct the centre, write positions in metres in the tissue frame, or state first_row = under_load"
        findings.append(of_rows("wrong", "start", what, do, row=0, column="px"))
    quaternion = experiment.quaternion_wxyz
    norm = np.linalg.norm(quaternion, axis=1)
    if np.any(np.abs(norm - 1) > 1e-3):
        row = int(np.argmax(np.abs(norm - 1) > 1e-3))
        what = f"the quaternion has the norm {norm[row]:.4g}"
        findings.append(
            of_rows("wrong", "start", what, "write unit quaternions, scalar first", row=row, column="qw")
        )
    elif abs(quaternion[0, 0]) < np.cos(np.radians(2.5)) and not loaded:
        last = abs(quaternion[0, 3]) > np.cos(np.radians(2.5))
        angle = 2 * np.degrees(np.arccos(min(1.0, abs(float(quaternion[0, 0])))))
        what = (
            "the quaternion is 0, 0, 0, 1: its scalar stands last"
            if last
            else f"the gripper starts turned by {angle:.1f} degrees"
        )
        do = "write the scalar first: qw qx qy qz" if last else "write the orientation relative to rest"
        findings.append(of_rows("wrong", "start", what, do, row=0, column="qw"))
    return findings


def check_bead_places(experiment: Experiment) -> list[Finding]:
    """A bead is on the body, or in it; two beads are not in one place."""
    body, rest, longest = body_box(experiment), experiment.fiducials_rest, longest_edge(experiment)
    if not len(rest):
        return []
    findings = []
    away = body.distance(rest)
    if np.any(away > _OFF_SURFACE * longest):
        worst = int(np.argmax(away))
        count = int(np.count_nonzero(away > _OFF_SURFACE * longest))
        what = f"number {worst} (from 0) lies {away[worst] * 1e3:.4g} mm off the phantom ({count} of {len(rest)} do)"
        do = "write metres in the tissue frame, whose origin is the phantom's centre"
        findings.append(of_facts("wrong", "places of beads", what, do, "[fiducials] rest"))
    depth = np.minimum(rest - body.lower, np.asarray(body.upper) - rest).min(axis=1)
    limit = max(SURELY * experiment.sensor.fiducial_std, _DEEP * longest)
    if experiment.phantom.shape == "block" and np.any(depth > limit):
        worst = int(np.argmax(depth))
        count = int(np.count_nonzero(depth > limit))
        what = f"number {worst} (from 0) lies {depth[worst] * 1e3:.3g} mm below the surface ({count} of {len(rest)} do)"
        do = "correct the size or the places, unless the beads are cast into the phantom"
        findings.append(of_facts("suspicious", "places of beads", what, do, "[fiducials] rest"))
    twins = _twins(rest)
    if twins is not None:
        what = f"numbers {twins[0]} and {twins[1]} (from 0) are in one place"
        findings.append(
            of_facts("wrong", "places of beads", what, "give each bead its own place", "[fiducials] rest")
        )
    return findings


def _twins(points: np.ndarray) -> tuple[int, int] | None:
    _, first, inverse = np.unique(points, axis=0, return_index=True, return_inverse=True)
    twin = np.flatnonzero(first[inverse.ravel()] != np.arange(len(points)))
    return (int(first[inverse.ravel()[twin[0]]]), int(twin[0])) if len(twin) else None


def _covers(box: Box, body: Box) -> bool:
    return bool(
        np.all(np.less_equal(box.lower, body.lower)) and np.all(np.greater_equal(box.upper, body.upper))
    )


def _outside(key: str, check: str, box: Box, body: Box) -> Finding:
    sizes = np.abs([*box.lower, *box.upper]).max() / max(np.abs([*body.lower, *body.upper]).max(), 1e-12)
    hint = "; its numbers are as if in millimetres" if 100 < sizes < 1e4 else ""
    what = f"holds no tissue: the phantom reaches from {list(body.lower)} to {list(body.upper)} m{hint}"
    return of_facts("wrong", check, what, "write two opposite corners in metres, in the tissue frame", key)
