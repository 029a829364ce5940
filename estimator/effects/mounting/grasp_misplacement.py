"""The grasped region lies elsewhere than stated."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimator.effects.blocks import Group
from estimator.effects.effect import Amplitude, Effect, Motion, Values
from estimator.effects.stages import Hook, Stage
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.equilibrium.morph import with_grasp_moved

FloatArray = NDArray[np.float64]


def _edge(axis: str, side: str) -> Amplitude:
    return Amplitude(f"edge_{axis}_{side}", "m", scale=1.5e-3, smallest=2e-4, lower=-0.006, upper=0.008)


class GraspMisplacement(Effect):
    """The gripper took the tissue elsewhere.

    It stood elsewhere over the tissue than registered, so that its frame's origin is shifted as well and the reported
    positions are off by as much; or the jaws alone hold another patch, shifted or turned, and the frame is where it is
    said to be, or a larger or smaller patch; or the patch is the stated one, and the frame's origin lies elsewhere on
    the jaws, which shows in turns and torques.

    Parameters
    ----------
    form : its name
    amplitudes : shift, turn, and by how much each edge lies farther out
    patch_moves, centre_shifts : what is shifted by them, the grasped patch and the frame's origin
    """

    label: ClassVar[str] = "grasp_misplacement"
    group: ClassVar[Group] = "grasp"
    stage: ClassVar[Stage] = "mounting"
    acts_on: ClassVar[tuple[Hook, ...]] = ("problem", "motion")
    words: ClassVar[str] = "The grasped region lies elsewhere than stated."

    def __init__(
        self, form: str, *amplitudes: Amplitude, patch_moves: bool = True, centre_shifts: bool = False
    ) -> None:
        self.form = form
        self.amplitudes = amplitudes
        self._patch_moves = patch_moves
        self._centre_shifts = centre_shifts

    def problem(self, problem: RetractionProblem, values: Values) -> RetractionProblem:
        """Move the grasped region in the tissue, and the origin."""
        shift, wider, turn = _along("shift", values), _along("wider", values), values.get("yaw", 0.0)
        if not (shift.any() or wider.any() or turn):
            return problem
        moved = with_grasp_moved(problem, shift[:2], turn, wider[:2]) if self._patch_moves else problem
        return replace(moved, grasp_centre=problem.grasp_centre + shift) if self._centre_shifts else moved

    def motion(self, motion: Motion, values: Values) -> Motion:
        """Shift the gripper frame where its origin lies elsewhere."""
        shift = _along("shift", values)
        if not (self._centre_shifts and shift.any()):
            return motion
        return motion.moved(motion.position + shift)


class GraspEdges(Effect):
    """Each edge of the grasped patch lies elsewhere by a way of its own, as where one jaw reaches further.

    Its sides at x₁ < x₂ lie at x₁ − e₁ and x₂ + e₂, those along y alike: shifted by (e₂ − e₁)/2 and larger by
    (e₁ + e₂)/2 on either side. The gripper's frame is where it is said to be.
    """

    label: ClassVar[str] = GraspMisplacement.label
    group: ClassVar[Group] = GraspMisplacement.group
    stage: ClassVar[Stage] = GraspMisplacement.stage
    acts_on: ClassVar[tuple[Hook, ...]] = ("problem",)
    words: ClassVar[str] = GraspMisplacement.words
    form = "edges"
    amplitudes = tuple(_edge(axis, side) for axis in "xy" for side in ("lower", "upper"))

    def problem(self, problem: RetractionProblem, values: Values) -> RetractionProblem:
        """Move the edges of the grasped region in the tissue."""
        out = np.array([values[amplitude.name] for amplitude in self.amplitudes])
        if not out.any():
            return problem
        lower, upper = out[::2], out[1::2]
        return with_grasp_moved(problem, (upper - lower) / 2, 0.0, (lower + upper) / 2)


def _along(name: str, values: Values) -> FloatArray:
    return np.array([values.get(f"{name}_x", 0.0), values.get(f"{name}_y", 0.0), 0.0])


_SHIFT = (
    Amplitude("shift_x", "m", scale=3e-3, smallest=2e-4, lower=-0.012, upper=0.012),
    Amplitude("shift_y", "m", scale=3e-3, smallest=2e-4, lower=-0.012, upper=0.012),
)
_WIDER = (
    Amplitude("wider_x", "m", scale=1e-3, smallest=1e-4, lower=-0.004, upper=0.008),
    Amplitude("wider_y", "m", scale=1e-3, smallest=1e-4, lower=-0.004, upper=0.008),
)
_YAW = Amplitude("yaw", "rad", scale=0.1, smallest=0.01, lower=-0.5, upper=0.5)
# Where the edges of the grasp may lie while the gripper is where it is said to be.
GRASP_EDGES = (GraspMisplacement("jaws", *_SHIFT), GraspMisplacement("turned", _YAW))
GRASP_MISPLACEMENT = (
    GraspMisplacement("gripper", *_SHIFT, centre_shifts=True),
    *GRASP_EDGES,
    GraspMisplacement("extent", *_WIDER),
    GraspMisplacement("origin", *_SHIFT, patch_moves=False, centre_shifts=True),
    GraspEdges(),
)
