"""An experiment that is only planned, rehearsed: what the baseline would show, and how causes would change that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.signatures import Signature, signatures_at
from estimator.diagnosis.fitting.case import Case, linearisation_of
from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import Mechanics, mechanics_of, solve_case
from estimator.diagnosis.noise.correlated_errors import correlated_errors_of
from estimator.diagnosis.noise.estimation import Noise
from estimator.effects.effect import Effect
from estimator.errors import SolverError
from estimator.experiment import Experiment
from estimator.inference.whitening import Whitening

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rehearsal:
    """What an experiment would show.

    Attributes
    ----------
    experiment : with what the baseline predicts in the place of measurements
    whitening : of its noise
    by_material : (r, f) whitened derivative by E and ν, as far as they are free
    signatures : of the causes that were asked for
    """

    experiment: Experiment
    whitening: Whitening
    by_material: FloatArray
    signatures: tuple[Signature, ...]


def rehearsed(
    case: Case,
    hypothesis: Hypothesis,
    planned: Experiment,
    plans: Sequence[tuple[Effect, Mapping[str, float]]],
) -> Rehearsal | None:
    """Rehearse an experiment with a hypothesis, on tissue that remembers nothing of what was done before.

    Parameters
    ----------
    case : of the phantom, mounting and beads; beads that were never seen are not seen in the rehearsal
    hypothesis : the fitted baseline
    planned : its rows; what it says of phantom and measurements does not count
    plans : effects with the constants at which their signatures are asked for

    Returns
    -------
    None where the tissue has no equilibrium in it.
    """
    try:
        felt, load, mechanics = _solved(case, hypothesis, _on_the_mounting(case.experiments, planned))
    except SolverError:
        return None
    zero = np.zeros((len(felt.time), 6 + 3 * len(felt.fiducials_rest)))
    whitening = correlated_errors_of(mechanics, zero, Noise(), case.settings.noise).whitening()
    mini = Case((felt,), case.problem, (load,), (zero,), (whitening,), settings=case.settings)
    linear = linearisation_of(mini, hypothesis, [mechanics])
    signatures = tuple(signatures_at(mini, [mechanics], hypothesis, plans))
    return Rehearsal(felt, whitening, linear.jacobian[0], signatures)


def _solved(
    case: Case, hypothesis: Hypothesis, planned: Experiment
) -> tuple[Experiment, GripLoad, Mechanics]:
    setup = Setup([planned], case.problem, [GripLoad.none(len(planned.time))], settings=case.settings)
    solution = solve_case(setup, hypothesis)[0]
    first = mechanics_of(solution)
    rows = solution.load_steps.of_row
    seen = np.isfinite(planned.fiducials)
    felt = replace(
        planned, wrench=first.wrench[rows], fiducials=np.where(seen, first.fiducials[rows], np.nan)
    )
    load = GripLoad(felt.wrench, felt.wrench / hypothesis.youngs_modulus)
    setup = Setup([felt], case.problem, [load], settings=case.settings)
    again = solve_case(setup, hypothesis, [solution.known_fields()])[0]
    return felt, load, mechanics_of(again)


def _on_the_mounting(experiments: Sequence[Experiment], planned: Experiment) -> Experiment:
    """Return the rows of a plan as an experiment that follows the last one of a case."""
    last, rows = experiments[-1], len(planned.time)
    seen = np.any([np.isfinite(one.fiducials).any(axis=(0, 2)) for one in experiments], axis=0)
    places = np.where(seen[:, None], last.fiducials_rest, np.nan)
    return replace(
        last,
        name=planned.name,
        order=max(one.order for one in experiments) + 1,
        trajectory_kind=planned.trajectory_kind,
        time=planned.time,
        phase=planned.phase,
        step=planned.step,
        position=planned.position,
        quaternion_wxyz=planned.quaternion_wxyz,
        wrench=np.zeros((rows, 6)),
        fiducials=np.broadcast_to(places, (rows, *places.shape)).copy(),
        path=None,
    )
