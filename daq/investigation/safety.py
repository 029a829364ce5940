"""What forbids a manoeuvre before it runs, and what it could damage."""

from dataclasses import dataclass

import numpy as np

from daq.errors import MotionLimitError
from daq.frames import compose, inverse
from daq.investigation.manoeuvre import Manoeuvre
from daq.rig import Rig
from daq.session.checks import check_limits, tool_targets
from estimator.optimal_design.foreseeing import Foresight
from robot_drivers.protocols import Pose


@dataclass(frozen=True, slots=True)
class Bounds:
    """How far an investigation may go, within what the rig file allows.

    Attributes
    ----------
    stretch : by what share the way from the grasp to an anchor may become longer, or shorter
    share_of_limits : of the limits of force and torque that may be foreseen
    stiffest_pa : Young's modulus that the tissue may have before anything was measured
    growth : by how many times the farthest stretch so far may be exceeded at once: tissue that stiffens is not
        foreseen from pulls much shorter
    """

    stretch: float = 0.25
    share_of_limits: float = 0.8
    stiffest_pa: float = 1e5
    growth: float = 3.0

    def __post_init__(self) -> None:
        if not (0 < self.stretch <= 1 and 0 < self.share_of_limits <= 1):
            raise ValueError("stretch and share_of_limits are shares from 0 to 1")
        if not (self.stiffest_pa > 0 and self.growth >= 1):
            raise ValueError("stiffest_pa is positive, growth 1 at least")


def forbidden_by_reach(manoeuvre: Manoeuvre, rig: Rig, bounds: Bounds) -> str:
    """Return why a manoeuvre leaves the limits of speed, step, workspace or stretch; empty where it does not."""
    trajectory = manoeuvre.trajectory()
    at_grasp = compose(rig.frames.T_base_tissue.pose, Pose(rig.specimen.grasp.centre))
    rest = compose(at_grasp, inverse(rig.frames.T_tool_gripper.pose))
    try:
        check_limits(rig, trajectory, tool_targets(rig, trajectory, rest))
    except MotionLimitError as error:
        return str(error)
    stretch = stretch_of(manoeuvre, rig)
    if stretch > bounds.stretch:
        return (
            f"it would stretch the tissue by {100 * stretch:.0f} %; the bound is {100 * bounds.stretch:.0f} %"
        )
    return ""


def forbidden_by_load(foresight: Foresight, rig: Rig, bounds: Bounds) -> str:
    """Return why the loads that are foreseen, under any answer, are too large; empty where they are not."""
    limits = rig.limits
    for value, limit, name, unit in (
        (foresight.largest_force, limits.force_n, "force", "N"),
        (foresight.largest_torque, limits.torque_nm, "torque", "N·m"),
    ):
        if not value <= bounds.share_of_limits * limit:
            return (
                f"a {name} of up to {value:.2g} {unit} is foreseen; allowed are {100 * bounds.share_of_limits:.0f} % "
                f"of the limit of {limit:g} {unit}"
            )
    return ""


def forbidden_unmeasured(manoeuvre: Manoeuvre, rig: Rig, bounds: Bounds) -> str:
    """Return why a manoeuvre is too bold before anything was measured; empty where it is not.

    The whole cross-section of the phantom, as stiff as it may be, is strained as a bar: tissue that is held at a part
    of its edge pulls less.
    """
    if any(manoeuvre.turn_rad):
        return "before anything was measured, nothing is turned"
    size = np.sort(rig.specimen.phantom.size_m)
    largest_section = float(size[-1] * size[-2] if manoeuvre.direction[2] else size[-1] * size[0])
    force = bounds.stiffest_pa * largest_section * stretch_of(manoeuvre, rig)
    if force > bounds.share_of_limits * rig.limits.force_n:
        return (
            f"tissue of {bounds.stiffest_pa / 1e3:g} kPa would pull with up to {force:.2g} N; allowed are "
            f"{100 * bounds.share_of_limits:.0f} % of the limit of {rig.limits.force_n:g} N"
        )
    return ""


def stretch_of(manoeuvre: Manoeuvre, rig: Rig) -> float:
    """Return by what share the way from the grasp to the nearest place of any anchor becomes longer, or shorter."""
    if not manoeuvre.strains:
        return 0.0
    grasp = np.asarray(rig.specimen.grasp.centre)
    moved = grasp + manoeuvre.amplitude_m * np.asarray(manoeuvre.direction)
    found = 0.0
    for box in rig.specimen.anchors:
        nearest = np.clip(grasp, box.lower, box.upper)
        before, after = (float(np.linalg.norm(place - nearest)) for place in (grasp, moved))
        found = max(found, abs(after - before) / max(before, 1e-6))
    return found


def damage(manoeuvre: Manoeuvre, rig: Rig, farthest: float) -> str:
    """Return what a manoeuvre could damage, for a person; empty where nothing new is risked.

    ``farthest`` is the largest stretch so far on this mounting.
    """
    stretch = stretch_of(manoeuvre, rig)
    if stretch > farthest:
        return (
            f"the tissue is stretched by {100 * stretch:.0f} %, farther than so far on this mounting "
            f"({100 * farthest:.0f} %): what softens, peels or slips by that stays so"
        )
    return ""
