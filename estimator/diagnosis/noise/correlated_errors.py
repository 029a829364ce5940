"""Errors that many rows of one experiment share, with everything that nobody calls an effect.

They are the zero of the wrench, the beads' stated rest positions, the reported pose of each load step, and what is left
of the discretisation error. How much there is of the last the measurements tell, of each bead beside the rim of the
grasp apart from anywhere else, for there meshes differ most and by what has nothing to do with the rest of the tissue;
and how much of what seem to be errors of the rest positions, for a misfit that meshes leave of single beads looks
alike.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.free_parameters import free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.solution import Mechanics
from estimator.diagnosis.noise.errors_left import AT_MOST, ErrorsLeft
from estimator.diagnosis.noise.estimation import Noise
from estimator.diagnosis.noise.refinement import Refinement, refinement_of
from estimator.diagnosis.sensitivity.perturbation import Perturbation
from estimator.diagnosis.sensitivity.readings import derivatives, derivatives_by_pose
from estimator.diagnosis.settings import NoiseSettings
from estimator.effects.mounting.grasp_misplacement import GRASP_EDGES
from estimator.experiment import Box, Experiment
from estimator.forward.schedule import schedule_poses, travel
from estimator.inference.channels import channel_variance, measured_rows, of_wrench, offsets
from estimator.inference.whitening import Whitening, inverse_root_scaled, uncorrelated

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CorrelatedErrors:
    """Directions of what the rows of one experiment have in common, each by one deviation in units of a value's noise.

    Attributes
    ----------
    seen : (n, c) bool, what was measured
    deviation : (c,) standard deviation of one value
    correlation : (c,) of one value's noise with that of the row before
    always : (r, k) whatever is left of the others
    at_rest : (r, 3m) the most that the beads' stated rest positions may be off
    elsewhere : (r, k) the most that meshes may leave of any channel
    beside_rim : (r, k) the most that they may leave beyond that of each bead beside the rim of the grasp, by its number
    """

    seen: NDArray[np.bool_]
    deviation: FloatArray
    correlation: FloatArray
    always: FloatArray
    at_rest: FloatArray
    elsewhere: FloatArray
    beside_rim: Mapping[int, FloatArray]

    def whitening(self, left: ErrorsLeft = AT_MOST) -> Whitening:
        """Return the whitening where these shares are left of what may be left at most."""
        directions, gram = self.at_most
        found = inverse_root_scaled(directions, self.sizes(left), gram)
        return Whitening(self.seen, self.deviation, self.correlation, *found)

    def sizes(self, left: ErrorsLeft) -> FloatArray:
        """Return the share (k,) that is left along each direction of what may be left at most."""
        shares = [1.0, left.at_rest, left.elsewhere]
        shares += [left.beside_rim[bead] if left.beside_rim else 1.0 for bead in self.beside_rim]
        return np.repeat(shares, [block.shape[1] for block in self._blocks])

    @property
    def _blocks(self) -> list[FloatArray]:
        return [self.always, self.at_rest, self.elsewhere, *self.beside_rim.values()]

    @cached_property
    def at_most(self) -> tuple[FloatArray, FloatArray]:
        """All directions (r, k) with the most that may be left, and their inner products (k, k)."""
        directions = np.hstack(self._blocks)
        return directions, directions.T @ directions


def correlated_errors_of(
    mechanics: Mechanics,
    correction: FloatArray,
    noise: Noise,
    settings: NoiseSettings,
    at_grasp: FloatArray | None = None,
) -> CorrelatedErrors:
    """Return what the rows of an experiment have in common.

    Parameters
    ----------
    mechanics : of the fitted baseline, for its derivative by the gripper's pose
    correction : (n, c) of the discretisation
    noise : what the file does not state of it
    settings : how much meshes may leave
    at_grasp : (n, c, k) what meshes make of the edges of the grasp, by one deviation; none where left out
    """
    load_steps = mechanics.solution.load_steps
    experiment = load_steps.experiment
    seen = np.isfinite(measured_rows(experiment))
    deviation = np.sqrt(channel_variance(experiment))
    rows, count = seen.shape
    by_wrench = of_wrench(count)
    correlation = np.where(by_wrench, noise.wrench_correlation, noise.fiducial_correlation)

    def in_all_rows(sizes: FloatArray) -> FloatArray:
        of_channels = offsets(sizes)
        return np.broadcast_to(of_channels, (rows, *of_channels.shape))

    def among_values(*directions: FloatArray) -> FloatArray:
        return uncorrelated(np.concatenate(directions, axis=2) / deviation[:, None], seen, correlation)

    reported = experiment.sensor.pose_std > 0.0
    by_pose = derivatives_by_pose(mechanics) * np.sqrt(load_steps.pose_variance)[:, None, :]
    of_load_steps = np.zeros((rows, count, len(load_steps), np.count_nonzero(reported)))
    of_load_steps[np.arange(rows), :, load_steps.of_row] = by_pose[load_steps.of_row][:, :, reported]
    always = [
        in_all_rows(np.where(by_wrench, noise.zero_deviation * deviation, 0.0)),
        of_load_steps.reshape(rows, count, -1),
    ]
    if at_grasp is not None:
        always.append(at_grasp)
    # The correction's course is not that of what is left of it: a bead may stand aside throughout. At rest it stands
    # where it is on every mesh, but its stated place may be off by what is usual for the beads.
    refinement = refinement_of(experiment)
    apart = refinement.share_left(settings.mesh_share_apart)
    aside = np.where(by_wrench, 0.0, apart * np.sqrt(np.mean(correction**2, axis=0)))
    usual = float(np.median(aside[6:])) if count > 6 else 0.0
    from_rest = np.where(by_wrench, 0.0, np.minimum(aside, usual))
    under_way = np.minimum(share_of_way(experiment) / settings.from_rest, 1.0)
    together = np.stack([np.where(by_wrench, correction, 0.0), np.where(by_wrench, 0.0, correction)], axis=-1)
    elsewhere = among_values(
        in_all_rows(from_rest),
        under_way[:, None, None] * np.diag(np.sqrt(aside**2 - from_rest**2)),
        apart * correction[:, :, None] * np.eye(count),
        refinement.share_left(settings.mesh_share_together) * together,
    )
    at_rest = among_values(in_all_rows(np.where(by_wrench, 0.0, noise.rest_deviation * deviation)))
    beside_rim = {
        bead: among_values(directions)
        for bead, directions in left_beside_rim(experiment, correction, settings).items()
    }
    return CorrelatedErrors(
        seen, deviation, correlation, among_values(*always), at_rest, elsewhere, beside_rim
    )


def share_of_way(experiment: Experiment) -> FloatArray:
    """Return how far the gripper is from rest in each row (n,), as a share of the farthest it goes."""
    schedule = schedule_poses(experiment)
    way = travel(schedule)[schedule.state_of_row]
    return np.asarray(way / max(float(way.max()), np.finfo(float).tiny))


def beside_rim_m(experiment: Experiment, settings: NoiseSettings) -> float:
    """Return how near to the grasp, m, beads feel its singular rim: within so many elements of the mesh."""
    return settings.beside_rim * refinement_of(experiment).rim_m


def beads_beside_rim(experiment: Experiment, settings: NoiseSettings) -> list[int]:
    """Return the numbers of the beads that are so near to the grasp that its rim tells on them."""
    distance = experiment.grasp.box.distance(experiment.fiducials_rest)
    return [int(bead) for bead in np.flatnonzero(distance < beside_rim_m(experiment, settings))]


def left_beside_rim(
    experiment: Experiment, correction: FloatArray, settings: NoiseSettings
) -> dict[int, FloatArray]:
    """Return directions (n, c, k), m, of what meshes make of each bead beside the grasp's rim, along the gripper's way.

    There the error falls with the root of the element size, and not along the correction's course alone, which may pass
    through zero where the difference is large. It depends on where the gripper is, and in tissue that remembers on how
    far it came back. ``correction`` (n, c) is that of the discretisation.
    """
    share = share_of_way(experiment)
    waves = share[:, None] * np.cos(np.pi * np.outer(share, np.arange(settings.waves_beside_rim)))
    back = np.maximum.accumulate(share) - share
    waves = np.column_stack([waves / np.sqrt(settings.waves_beside_rim), back])
    rows, count = correction.shape
    of_largest = refinement_of(experiment).share_left(settings.mesh_share_beside_rim)
    found = {}
    for bead in beads_beside_rim(experiment, settings):
        own = slice(6 + 3 * bead, 9 + 3 * bead)
        size = of_largest * np.linalg.norm(correction[:, own], axis=1).max()
        directions = np.zeros((rows, count, 3, waves.shape[1]))
        directions[:, own] = size * np.eye(3)[None, :, :, None] * waves[:, None, None, :]
        found[bead] = directions.reshape(rows, count, -1)
    return found


def left_at_grasp(
    mechanics: Sequence[Mechanics],
    hypothesis: Hypothesis,
    corrections: Sequence[FloatArray],
    settings: NoiseSettings,
) -> list[FloatArray]:
    """Return for each experiment what a mesh makes of the singular edges of the grasp (n, c, k), by one deviation.

    Parameters
    ----------
    mechanics : of each experiment, solved under the hypothesis
    corrections : of the discretisation, (n, c) each
    """
    experiment = mechanics[0].solution.load_steps.experiment
    aside = edge_deviation(hypothesis, refinement_of(experiment), settings)
    steps, units = [], []
    for form in GRASP_EDGES:
        null = hypothesis.with_effect(form, {amplitude.name: 0.0 for amplitude in form.amplitudes})
        free = [c for c in free_parameters(null) if c.effect is not None]
        steps += [Perturbation(c.name, c.put(null, c.step), form, c.step) for c in free]
        units += [c.unit for c in free]
    slopes = derivatives(mechanics, hypothesis, steps, corrections)
    grasps = [each.solution.load_steps.experiment.grasp.box for each in mechanics]
    return [
        aside * np.array([1.0 if unit == "m" else 1.0 / edge_lever(grasp) for unit in units]) * slope
        for grasp, slope in zip(grasps, slopes, strict=True)
    ]


def edge_lever(grasp: Box) -> float:
    """Return at which distance, m, edges that are turned lie aside by as much as edges that are shifted.

    It is the root-mean-square distance of an edge's points from its middle.
    """
    along_x, along_y, _ = np.subtract(grasp.upper, grasp.lower)
    return float(np.mean([along_x, along_y]) / np.sqrt(12.0))


def edge_deviation(hypothesis: Hypothesis, refinement: Refinement, settings: NoiseSettings) -> float:
    """Return by how much meshes act as if the edges of the grasp lay aside, one standard deviation in m.

    Strains are singular there, the more so the less the tissue can be compressed. Where something is amiss the
    baseline's ν may be far off.
    """
    ratio = min(hypothesis.poisson_ratio, settings.largest_ratio_of_edges)
    return settings.edge_shift * refinement.finer_rim_m / (1.0 - 2.0 * ratio)
