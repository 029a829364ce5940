"""A case ready for diagnosis: its experiments, its mesh, and its noise; and what a hypothesis predicts for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.model.free_parameters import HypothesisParameter, free_parameters
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import KnownFields, Mechanics, mechanics_of, solve_case
from estimator.diagnosis.model.term_history import TermHistory
from estimator.diagnosis.noise.errors_left import AT_MOST, ErrorsLeft
from estimator.diagnosis.sensitivity.perturbation import Perturbation
from estimator.diagnosis.sensitivity.readings import channels, derivatives, predicted_readings
from estimator.inference.channels import measured_rows
from estimator.inference.linear_model import chi2_of
from estimator.inference.material_parameters import POISSON_RATIO
from estimator.inference.whitening import Whitening

FloatArray = NDArray[np.float64]
Progress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Case(Setup):
    """Experiments of one phantom in one mounting, with what is known of their noise and of the mesh.

    Attributes
    ----------
    corrections : for each experiment (n, 6 + 3m), what a finer mesh changes
    whitenings : of each experiment
    errors_left : how much of the errors that rows may share the whitenings take for noise
    """

    corrections: Sequence[FloatArray]
    whitenings: Sequence[Whitening]
    errors_left: ErrorsLeft = field(default=AT_MOST, kw_only=True)


@dataclass(frozen=True, eq=False)
class Linearisation:
    """A hypothesis compared with the measurements, and its derivatives; all whitened, by experiment.

    Attributes
    ----------
    hypothesis, free_parameters : the point, and what is free there
    predicted : for each experiment (n, 6 + 3m), channels
    residual : for each (r,), measured minus predicted
    jacobian : for each (r, p)
    known : fields, from which a neighbouring hypothesis starts
    mechanics : for each experiment, without its states
    next_share : of the Newton step from here, which a refit tries next; what was longer did not fit better
    """

    hypothesis: Hypothesis
    free_parameters: tuple[HypothesisParameter, ...]
    predicted: tuple[FloatArray, ...]
    residual: tuple[FloatArray, ...]
    jacobian: tuple[FloatArray, ...]
    known: KnownFields
    mechanics: tuple[Mechanics, ...]
    next_share: float = 1.0

    @property
    def chi2(self) -> float:
        """Sum of the squared whitened residuals."""
        return chi2_of(self.residual)


@dataclass(frozen=True, eq=False)
class Foretold:
    """What a hypothesis foretells of a case, and its derivatives, in the units of the sensors.

    Attributes
    ----------
    hypothesis, free_parameters : the point, and what is free there
    predicted : for each experiment (n, 6 + 3m), channels
    slopes : for each (n, 6 + 3m, p), their derivatives by the internal variables
    known, mechanics : as of :class:`Linearisation`
    """

    hypothesis: Hypothesis
    free_parameters: tuple[HypothesisParameter, ...]
    predicted: tuple[FloatArray, ...]
    slopes: tuple[FloatArray, ...]
    known: KnownFields
    mechanics: tuple[Mechanics, ...]


def linearise(
    case: Case, hypothesis: Hypothesis, near: Linearisation | None = None, progress: Progress | None = None
) -> Linearisation:
    """Solve a case under a hypothesis and compare it with the measurements.

    ``near`` is a solved neighbour. Where neither has an effect on the tissue and ν is close, its mechanics are
    extrapolated instead of solved anew.

    Raises
    ------
    SolverError
        A load step has no equilibrium under the hypothesis.
    """
    return compared(case, foretell(case, hypothesis, near, progress))


def foretell(
    case: Case, hypothesis: Hypothesis, near: Linearisation | None = None, progress: Progress | None = None
) -> Foretold:
    """Solve a case under a hypothesis as :func:`linearise` does, without a look at what was measured.

    Raises
    ------
    SolverError
        A load step has no equilibrium under the hypothesis.
    """
    mechanics, known = _mechanics_near(case, hypothesis, near, progress)
    return _foretold_by(case, hypothesis, mechanics, known)


def compared(case: Case, foretold: Foretold) -> Linearisation:
    """Compare what a hypothesis foretells with the measurements of a case."""
    return Linearisation(
        foretold.hypothesis,
        foretold.free_parameters,
        foretold.predicted,
        tuple(_whitened_misfits(case, foretold.predicted)),
        tuple(_whitened(case, foretold.slopes)),
        foretold.known,
        foretold.mechanics,
    )


def residuals_near(case: Case, hypothesis: Hypothesis, near: Linearisation) -> list[FloatArray]:
    """Return the whitened misfit (r,) of each experiment under a hypothesis, without derivatives.

    Raises
    ------
    SolverError
        A load step has no equilibrium under the hypothesis.
    """
    mechanics, _ = _mechanics_near(case, hypothesis, near, None)
    return residuals(case, mechanics, hypothesis)


def _mechanics_near(
    case: Case, hypothesis: Hypothesis, near: Linearisation | None, progress: Progress | None
) -> tuple[list[Mechanics], KnownFields | None]:
    """Return the mechanics of every experiment, and the fields they go by where they are a neighbour's."""
    if near is not None and same_mechanics(near.hypothesis, hypothesis, case.settings.solver.near):
        return [one.at(near.hypothesis, hypothesis) for one in near.mechanics], near.known
    known = near.known if near is not None else None
    free = free_parameters(hypothesis, case.settings.fitting)
    every = poses_apart(case, hypothesis, [perturbed(hypothesis, parameter).to for parameter in free])
    solutions = solve_case(case, hypothesis, known, progress, every=every)
    return [mechanics_of(solution) for solution in solutions], None


def linearisation_of(case: Case, hypothesis: Hypothesis, mechanics: Sequence[Mechanics]) -> Linearisation:
    """Compare solved mechanics with the measurements."""
    return compared(case, _foretold_by(case, hypothesis, mechanics, None))


def _foretold_by(
    case: Case, hypothesis: Hypothesis, mechanics: Sequence[Mechanics], known: KnownFields | None
) -> Foretold:
    """Return what solved mechanics foretell; fields are theirs unless they are given."""
    free = free_parameters(hypothesis, case.settings.fitting)
    perturbations = [perturbed(hypothesis, parameter) for parameter in free]
    return Foretold(
        hypothesis,
        free,
        tuple(predictions(case, mechanics, hypothesis)),
        tuple(derivatives(mechanics, hypothesis, perturbations, case.corrections)),
        known or [one.solution.known_fields() for one in mechanics],
        tuple(one.without_states() for one in mechanics),
    )


def poses_apart(setup: Setup, hypothesis: Hypothesis, near: Sequence[Hypothesis]) -> int:
    """Return every how many poses of a hypothesis are to be solved, that others ``near`` it can be foretold there.

    Where one of them remembers, or has its time, it goes by every load step.
    """
    problem, first = hypothesis.problem(setup.problem), setup.experiments[0]
    steady = all(TermHistory.begun(one, problem, first).steady for one in (hypothesis, *near))
    return setup.settings.solver.poses_apart if steady else 1


def same_mechanics(one: Hypothesis, other: Hypothesis, near: float) -> bool:
    """Tell whether the tissue behaves as the baseline's under both, at nearly the same ν.

    ``near`` is the change of −ln(1 − 2ν) from which on it is not.
    """
    on_tissue = any(effect.acts_on_tissue for effect in (*one.effects, *other.effects))
    here, there = (POISSON_RATIO.transform.internal_of(each.poisson_ratio) for each in (one, other))
    return not on_tissue and abs(here - there) < near


def perturbed(hypothesis: Hypothesis, parameter: HypothesisParameter) -> Perturbation:
    """Return the hypothesis a small step along a parameter, away from a bound on which it stands."""
    here = parameter.of(hypothesis).internal
    step = parameter.step
    if parameter.transform.value_of(here + step) > parameter.upper:
        step = -step
    effect = None if parameter.effect is None else hypothesis.effects[parameter.effect]
    return Perturbation(parameter.name, parameter.put(hypothesis, here + step), effect, step)


def predictions(case: Case, mechanics: Sequence[Mechanics], hypothesis: Hypothesis) -> list[FloatArray]:
    """Return the predicted channels (n, 6 + 3m) of each experiment."""
    return [
        channels(predicted_readings(one, hypothesis, correction))
        for one, correction in zip(mechanics, case.corrections, strict=True)
    ]


def residuals(case: Case, mechanics: Sequence[Mechanics], hypothesis: Hypothesis) -> list[FloatArray]:
    """Return the whitened misfit (r,) of each experiment."""
    return _whitened_misfits(case, predictions(case, mechanics, hypothesis))


def whitened_derivatives(
    case: Case,
    mechanics: Sequence[Mechanics],
    hypothesis: Hypothesis,
    perturbations: Sequence[Perturbation],
) -> list[FloatArray]:
    """Return the whitened derivative (r, k) of each experiment by each perturbation."""
    return _whitened(case, derivatives(mechanics, hypothesis, perturbations, case.corrections))


def _whitened_misfits(case: Case, predicted: Sequence[FloatArray]) -> list[FloatArray]:
    return [
        whitening.residual(measured_rows(experiment), channels)
        for whitening, experiment, channels in zip(case.whitenings, case.experiments, predicted, strict=True)
    ]


def _whitened(case: Case, columns: Sequence[FloatArray]) -> list[FloatArray]:
    return [whitening.apply(each) for whitening, each in zip(case.whitenings, columns, strict=True)]
