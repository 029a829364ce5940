"""Whether a body is held so that a model can be solved: by its tissue, apart from the grasp, against every motion."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.experiment.holds import AXES, Axis, Box, FloatArray
from estimator.experiment.model import Experiment, Phantom
from estimator.surfaces.reading import surface_bounds

# Of the longest edge: a fiducial that is farther off the body is not on it.
_OFF_BODY = 0.05
# Of the body's edge: a box that reaches no farther into it holds a face.
_FLAT = 0.01
# Supports whose lever is a smaller share of the body than this do not keep it from turning.
_LEVER = 5e-3
_MOST_TURN_DEG = 5.0
# A sheet is thinner than this share of its width, and held over less than this share of its area.
_THIN = 1 / 20
_HELD_AREA = 0.5
# Standard deviations beyond which beads have left the plane.
_SURELY = 5.0
# Of the body: what files in single precision round off.
_LAST_DIGIT = 1e-7


def check_support(experiment: Experiment, stated: Path, observed: Path) -> None:
    """Check that grasp, anchors and rollers hold tissue, that they do not contradict, and that nothing is loose.

    Raises
    ------
    InputError
        At the first thing that cannot be right, as one line; it names the file of the facts or of the rows.
    """
    if experiment.order < 1:
        raise InputError(f"{stated}: order is {experiment.order}; number the experiments from 1")
    body = bounds_of(experiment.phantom)
    grasp = experiment.grasp.box
    _check_holds_tissue(grasp, body, f"{stated}: [grasp] box")
    if not (experiment.anchors or experiment.directed):
        raise InputError(f"{stated}: no [[anchor]]; state at least one box whose tissue does not move")
    for i, anchor in enumerate(experiment.anchors, start=1):
        _check_holds_tissue(anchor, body, f"{stated}: [[anchor]] {i} box")
        if anchor.overlaps_within(grasp, body):
            raise InputError(
                f"{stated}: [[anchor]] {i} box overlaps [grasp] box in the tissue, which cannot both stand and "
                "move; part them"
            )
    _check_rollers(experiment, body, stated)
    _check_prescribed(experiment, body, stated)
    _check_sliding_grasp(experiment, body, stated, observed)
    weight = experiment.specific_weight
    if np.any(np.abs(unheld_motions(experiment)[:, :3] @ weight) > _LEVER * np.linalg.norm(weight)):
        raise InputError(
            f"{stated}: the weight acts, and nothing keeps the phantom from moving {in_words(experiment)[0]}; add the "
            "[[anchor]] that holds it, or the [[roller]] of a plate"
        )
    away = body.distance(experiment.fiducials_rest)
    if np.any(away > _OFF_BODY * max(experiment.phantom.size_m)):
        worst = int(np.argmax(away))
        raise InputError(
            f"{stated}: [fiducials] rest number {worst} (from 0) lies {away[worst]:g} m off the phantom; "
            "write metres in the tissue frame, whose origin is the phantom's centre"
        )


def bounds_of(phantom: Phantom) -> Box:
    """Return the box around a body, m."""
    if phantom.surface is None:
        x, y, z = (edge / 2 for edge in phantom.size_m)
        return Box((-x, -y, -z), (x, y, z))
    (x0, y0, z0), (x1, y1, z1) = surface_bounds(phantom.surface, phantom.unit).tolist()
    return Box((x0, y0, z0), (x1, y1, z1))


def thin_axis(phantom: Phantom) -> int:
    """Return the number of the axis along which a block is thinnest."""
    return int(np.argmin(phantom.size_m))


def stays_flat(experiment: Experiment) -> bool:
    """Tell whether a sheet stays in its plane: as is stated, or where nothing is, if it is a loose thin sheet."""
    stated = experiment.phantom.stays_flat
    return is_loose_sheet(experiment) if stated is None else stated


def supposed_flat(experiment: Experiment) -> str:
    """Return the sentence that tells of a sheet that is supposed to stay in its plane; nothing where none is."""
    if experiment.phantom.stays_flat is not None or not is_loose_sheet(experiment):
        return ""
    thin, wide, _ = sorted(experiment.phantom.size_m)
    return (
        f"The sheet, {1e3 * thin:.3g} mm thin, {1e3 * wide:.3g} mm wide and held by a part of it, is taken to stay in "
        "its plane: loose it would wrinkle under next to nothing. The experiment's file can say whether it does, as "
        "retract check tells."
    )


def is_loose_sheet(experiment: Experiment) -> bool:
    """Tell whether a block is a thin sheet held by a part of it, which neither moves nor is seen out of its plane."""
    phantom = experiment.phantom
    thin = thin_axis(phantom)
    others = [axis for axis in range(3) if axis != thin]
    size = np.asarray(phantom.size_m)
    if phantom.surface is not None or size[thin] > _THIN * size[others].min():
        return False
    body = bounds_of(phantom)
    held = [box.intersection(body) for box in (*experiment.anchors, experiment.grasp.box)]
    area = sum(float(np.prod(np.subtract(one.upper, one.lower)[others])) for one in held if one is not None)
    gripper = experiment.position[:, thin] - experiment.grasp.centre[thin]
    beads = (experiment.fiducials - experiment.fiducials_rest)[..., thin]
    seen = float(np.nanmax(np.abs(beads), initial=0.0))
    noise = _SURELY * float(experiment.sensor.bead_std[thin])
    in_plane = np.abs(gripper).max() < size[thin] and seen < max(size[thin], noise)
    return bool(in_plane) and area < _HELD_AREA * float(np.prod(size[others]))


def unheld_motions(experiment: Experiment) -> FloatArray:
    """Return the rigid motions (k, 6) of the body that nothing prevents: translation, and turn by its longest edge."""
    body = bounds_of(experiment.phantom)
    held = [(anchor, AXES) for anchor in experiment.anchors]
    held += [(one.box, one.directions) for one in experiment.directed]
    held.append((experiment.grasp.box, experiment.grasp.directions))
    if stays_flat(experiment):
        thin = thin_axis(experiment.phantom)
        corners = np.array([body.lower, body.upper])
        corners[:, thin] = 0.0
        held.append((_box(corners), (AXES[thin],)))
    scale = max(experiment.phantom.size_m)
    rows = [row for box, directions in held for row in _prevented(box, directions, body, scale)]
    _, size, motions = np.linalg.svd(np.array(rows))
    return np.asarray(motions[np.count_nonzero(size > _LEVER * size[0]) :])


def in_words(experiment: Experiment) -> list[str]:
    """Return the motions that nothing prevents, such as "along x"."""
    names = [*(f"along {axis}" for axis in AXES), *(f"about {axis}" for axis in AXES)]
    free = unheld_motions(experiment)
    chosen = np.argsort(-np.linalg.norm(free, axis=0), kind="stable")[: len(free)]
    return [names[number] for number in sorted(chosen.tolist())]


def _prevented(box: Box, directions: tuple[Axis, ...], body: Box, scale: float) -> list[FloatArray]:
    """Return for each corner of what is held, and each direction, the rigid motion (6,) that it prevents."""
    shared = _shared(box, body)
    if shared is None:
        return []
    limits = np.array([shared.lower, shared.upper]) / scale
    corners = np.stack(np.meshgrid(*limits.T, indexing="ij"), axis=-1).reshape(-1, 3)
    units = np.eye(3)[[AXES.index(direction) for direction in directions]]
    return [np.concatenate([unit, np.cross(corner, unit)]) for corner in corners for unit in units]


def _check_rollers(experiment: Experiment, body: Box, file: Path) -> None:
    grasp = experiment.grasp
    for i, roller in enumerate(experiment.rollers, start=1):
        label = f"{file}: [[roller]] {i}"
        _check_holds_tissue(roller.box, body, f"{label} box")
        shared = roller.box.intersection(grasp.box)
        within = None if shared is None else _shared(shared, body)
        both = [axis for axis in roller.directions if axis in grasp.directions]
        if within is not None and both and _sides(within, body) >= 2:
            raise InputError(
                f"{label} box overlaps [grasp] box in the tissue, which cannot both stand and move along {both[0]}; "
                "part them"
            )


def _check_prescribed(experiment: Experiment, body: Box, file: Path) -> None:
    grasp = _shared(experiment.grasp.box, body)
    for i, prescribed in enumerate(experiment.prescribed, start=1):
        if not 0 <= prescribed.reach <= max(experiment.phantom.size_m):
            raise InputError(
                f"{file}: [[prescribed]] {i} reach is {prescribed.reach:g} m; write 0 or more, in metres"
            )
        _check_holds_tissue(prescribed.box, body, f"{file}: [[prescribed]] {i} box")
        shared = None if grasp is None else prescribed.box.intersection(grasp)
        if shared is not None and grasp is not None and _sides(grasp, body) > 2 and _sides(shared, body) > 1:
            raise InputError(
                f"{file}: [[prescribed]] {i} box leads tissue in [grasp] box, which has a volume; give the grasp a "
                "flat box, on which the force is felt"
            )


def _check_sliding_grasp(experiment: Experiment, body: Box, stated: Path, observed: Path) -> None:
    grasp = experiment.grasp
    if not grasp.slides:
        return
    shared = _shared(grasp.box, body)
    if shared is not None and _sides(shared, body) > 2:
        raise InputError(
            f"{stated}: [grasp] directions leave some out, and its box has a volume; tissue slides on a face: give a "
            "flat box"
        )
    turned = 2 * np.degrees(np.arccos(np.minimum(np.abs(experiment.quaternion_wxyz[:, 0]), 1.0)))
    if np.any(turned > _MOST_TURN_DEG):
        raise InputError(
            f"{observed}: the gripper turns by {turned.max():.1f} degrees, and [grasp] directions are along the axes "
            "of the tissue frame; leave them out, or take rows in which it has not turned"
        )


def holds_tissue(box: Box, body: Box) -> bool:
    """Tell whether a box shares a volume or a face with a body; an edge or a corner holds nothing."""
    shared = _shared(box, body)
    least = 3 * _LAST_DIGIT * np.subtract(body.upper, body.lower).max()
    return shared is not None and bool(np.sum(np.subtract(shared.upper, shared.lower) > least) >= 2)


def _shared(box: Box, body: Box) -> Box | None:
    """Return what a box shares with a body.

    A face in a file of single precision may lie a last digit inside of where it is said to be.
    """
    margin = _LAST_DIGIT * np.subtract(body.upper, body.lower).max()
    return box.intersection(_box(np.add([body.lower, body.upper], [[-margin], [margin]])))


def _check_holds_tissue(box: Box, body: Box, label: str) -> None:
    if not holds_tissue(box, body):
        raise InputError(
            f"{label} holds no tissue (the phantom reaches from {list(body.lower)} to {list(body.upper)} m); "
            "write two opposite corners in metres, in the tissue frame"
        )


def _sides(box: Box, body: Box) -> int:
    """Return along how many axes a box reaches into a body, not counting those along which it is as good as flat."""
    share: NDArray[np.float64] = np.subtract(box.upper, box.lower) / np.subtract(body.upper, body.lower)
    return int(np.count_nonzero(share > _FLAT))


def _box(corners: FloatArray) -> Box:
    (x0, y0, z0), (x1, y1, z1) = corners.tolist()
    return Box((x0, y0, z0), (x1, y1, z1))
