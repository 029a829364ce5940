"""Errors that many rows of one experiment share, with everything that nobody calls an effect.

They are the zero of the wrench, the beads' stated rest positions, the reported pose of each visit, and what is left of
the discretisation error. How much there is of the last the measurements tell, of each bead beside the rim of the grasp
apart from anywhere else, for there meshes differ most and by what has nothing to do with the rest of the tissue; and
how much of what seem to be errors of the rest positions, for a misfit that meshes leave of single beads looks alike.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.hypothesis import Hypothesis, coordinates
from estimator.diagnosis.noise import Noise
from estimator.diagnosis.passage import Mechanics
from estimator.diagnosis.perturbation import Perturbation
from estimator.diagnosis.prediction import derivatives, derivatives_by_position
from estimator.diagnosis.result import AT_MOST, ErrorsLeft
from estimator.diagnosis.whitening import Whitening, inverse_root, uncorrelated
from estimator.effects.mounting.grasp_misplacement import GRASP_EDGES
from estimator.experiment import Experiment
from estimator.fit.residuals import channel_variance, measured_rows
from estimator.forward.schedule import schedule_poses, travel

FloatArray = NDArray[np.float64]

# What is left of the discretisation error after its correction, as a share of the correction: for each channel apart,
# and of all channels of a kind together, for others' meshes err along with ours. The measurements of 13 clean cases of
# two other simulators are most probable with 0.05 apart and 0.1 together, those of a coarser mesh with 0.2 to 0.3
# together; of ten cases of one cause, at that cause, with 0.15 to 0.3 apart.
_LEFT_APART, _LEFT_TOGETHER = 0.2, 0.3
# Beside the rim of the grasp, where the solution is singular, the error falls with the root of the element size: even
# fine meshes differ in what a bead there does, and not along the correction's course alone, which may pass through zero
# where the difference is large. Most probable are 0.2 to 0.3 of the correction's largest length, 0.5 where tissue rubs.
_LEFT_BESIDE_RIM = 0.5
BESIDE_RIM_M = 6e-3
_WAVES_BESIDE_RIM = 4
# Strains are singular along the edges of the grasp, the more so the less the tissue can be compressed, and a mesh acts
# as if these lay aside by this over 1 - 2 nu. The measurements of 21 clean cases of two other simulators are most
# probable with it, by 28 nats more than without: the shifts that they show grow like that, to 50 and 96 um at nu 0.475.
# None of them is nearer to incompressible than this, and where something is amiss the baseline's nu may be far off.
_EDGE_LEFT_M, _LARGEST_RATIO_SEEN = 2e-6, 0.48
# And as if they were turned, by what moves them by as much at this distance from the middle: 23 clean cases of another
# simulator are more probable by 16 nats with it than without, by 10 and 11 nats with twice and with half the distance.
_EDGE_LEVER_M = 5e-3
# Tissue at rest is at rest on every mesh; from this share of the way on a bead may stand aside in full.
_FROM_REST = 0.1


@dataclass(frozen=True, eq=False)
class SharedErrors:
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
        beside_rim = [
            (left.beside_rim[bead] if left.beside_rim else 1.0) * block
            for bead, block in self.beside_rim.items()
        ]
        directions = np.hstack(
            [self.always, left.at_rest * self.at_rest, left.elsewhere * self.elsewhere, *beside_rim]
        )
        return Whitening(self.seen, self.deviation, self.correlation, *inverse_root(directions))


def shared_errors_of(
    mechanics: Mechanics, correction: FloatArray, noise: Noise, at_grasp: FloatArray | None = None
) -> SharedErrors:
    """Return what the rows of an experiment have in common.

    Parameters
    ----------
    mechanics : of the fitted baseline, for its derivative by the gripper's position
    correction : (n, c) of the discretisation
    noise : what the file does not state of it
    at_grasp : (n, c, k) what meshes make of the edges of the grasp, by one deviation; none where left out
    """
    visits = mechanics.passage.visits
    experiment = visits.experiment
    seen = np.isfinite(measured_rows(experiment))
    deviation = np.sqrt(channel_variance(experiment))
    rows, count = seen.shape
    of_wrench = np.arange(count) < 6
    correlation = np.where(of_wrench, noise.wrench_correlation, noise.fiducial_correlation)

    def in_all_rows(offsets: FloatArray) -> FloatArray:
        of_channels = np.diag(offsets)[:, np.flatnonzero(offsets)]
        return np.broadcast_to(of_channels, (rows, *of_channels.shape))

    def among_values(*directions: FloatArray) -> FloatArray:
        return uncorrelated(np.concatenate(directions, axis=2) / deviation[:, None], seen, correlation)

    by_position = derivatives_by_position(mechanics) * np.sqrt(visits.position_variance)[:, None, None]
    of_visits = np.zeros((rows, count, len(visits), 3))
    of_visits[np.arange(rows), :, visits.of_row] = by_position[visits.of_row]
    always = [
        in_all_rows(np.where(of_wrench, noise.zero_deviation * deviation, 0.0)),
        of_visits.reshape(rows, count, -1),
    ]
    if at_grasp is not None:
        always.append(at_grasp)
    # The correction's course is not that of what is left of it: a bead may stand aside throughout. At rest it stands
    # where it is on every mesh, but its stated place may be off by what is usual for the beads.
    aside = np.where(of_wrench, 0.0, _LEFT_APART * np.sqrt(np.mean(correction**2, axis=0)))
    usual = float(np.median(aside[6:])) if count > 6 else 0.0
    from_rest = np.where(of_wrench, 0.0, np.minimum(aside, usual))
    under_way = np.minimum(share_of_way(experiment) / _FROM_REST, 1.0)
    together = np.stack([np.where(of_wrench, correction, 0.0), np.where(of_wrench, 0.0, correction)], axis=-1)
    elsewhere = among_values(
        in_all_rows(from_rest),
        under_way[:, None, None] * np.diag(np.sqrt(aside**2 - from_rest**2)),
        _LEFT_APART * correction[:, :, None] * np.eye(count),
        _LEFT_TOGETHER * together,
    )
    at_rest = among_values(in_all_rows(np.where(of_wrench, 0.0, noise.rest_deviation * deviation)))
    beside_rim = {
        bead: among_values(directions) for bead, directions in left_beside_rim(experiment, correction).items()
    }
    return SharedErrors(seen, deviation, correlation, among_values(*always), at_rest, elsewhere, beside_rim)


def share_of_way(experiment: Experiment) -> FloatArray:
    """Return how far the gripper is from rest in each row (n,), as a share of the farthest it goes."""
    schedule = schedule_poses(experiment)
    way = travel(schedule)[schedule.state_of_row]
    return np.asarray(way / max(float(way.max()), np.finfo(float).tiny))


def beads_beside_rim(experiment: Experiment) -> list[int]:
    """Return the numbers of the beads that are so close to the grasp that its rim tells on them."""
    distance = experiment.grasp.box.distance(experiment.fiducials_rest)
    return [int(bead) for bead in np.flatnonzero(distance < BESIDE_RIM_M)]


def left_beside_rim(experiment: Experiment, correction: FloatArray) -> dict[int, FloatArray]:
    """Return directions (n, c, k), m, of what meshes make of each bead beside the grasp's rim, along the gripper's way.

    It depends on where the gripper is, and in tissue that remembers on how far it came back. ``correction`` (n, c) is
    that of the discretisation.
    """
    share = share_of_way(experiment)
    waves = share[:, None] * np.cos(np.pi * np.outer(share, np.arange(_WAVES_BESIDE_RIM)))
    back = np.maximum.accumulate(share) - share
    waves = np.column_stack([waves / np.sqrt(_WAVES_BESIDE_RIM), back])
    rows, count = correction.shape
    found = {}
    for bead in beads_beside_rim(experiment):
        own = slice(6 + 3 * bead, 9 + 3 * bead)
        size = _LEFT_BESIDE_RIM * np.linalg.norm(correction[:, own], axis=1).max()
        directions = np.zeros((rows, count, 3, waves.shape[1]))
        directions[:, own] = size * np.eye(3)[None, :, :, None] * waves[:, None, None, :]
        found[bead] = directions.reshape(rows, count, -1)
    return found


def left_at_grasp(
    mechanics: Sequence[Mechanics], hypothesis: Hypothesis, corrections: Sequence[FloatArray]
) -> list[FloatArray]:
    """Return for each experiment what a mesh makes of the singular edges of the grasp (n, c, k), by one deviation.

    Parameters
    ----------
    mechanics : of each experiment, solved under the hypothesis
    corrections : of the discretisation, (n, c) each
    """
    deviation = {"m": edge_deviation(hypothesis), "rad": edge_deviation(hypothesis) / _EDGE_LEVER_M}
    steps, deviations = [], []
    for form in GRASP_EDGES:
        null = hypothesis.with_effect(form, {amplitude.name: 0.0 for amplitude in form.amplitudes})
        free = [c for c in coordinates(null) if c.effect is not None]
        steps += [Perturbation(c.name, c.put(null, c.step), form, c.step) for c in free]
        deviations += [deviation[c.unit] for c in free]
    return [np.array(deviations) * slope for slope in derivatives(mechanics, hypothesis, steps, corrections)]


def edge_deviation(hypothesis: Hypothesis) -> float:
    """Return by how much meshes act as if the edges of the grasp lay aside, one standard deviation in m."""
    return _EDGE_LEFT_M / (1.0 - 2.0 * min(hypothesis.poisson_ratio, _LARGEST_RATIO_SEEN))
