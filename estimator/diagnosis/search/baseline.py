"""From experiments to a case with its fitted baseline: mesh, discretisation error, noise."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.evidence.noise_floor import white_floor
from estimator.diagnosis.evidence.noise_selection import CaseLeaving, in_another_case
from estimator.diagnosis.fitting.case import Case, Linearisation, linearisation_of, predictions
from estimator.diagnosis.fitting.parallel import solved_by
from estimator.diagnosis.fitting.refit import refit
from estimator.diagnosis.model.grip_load import GripLoad, without_noise
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import Mechanics, mechanics_of, solve_case
from estimator.diagnosis.noise.correlated_errors import (
    CorrelatedErrors,
    beside_rim_m,
    correlated_errors_of,
    edge_deviation,
    left_at_grasp,
)
from estimator.diagnosis.noise.discretisation import (
    channels_at,
    channels_met,
    correction_along,
    few_poses,
    load_steps_of_few,
    poses_at_rest_and_few,
)
from estimator.diagnosis.noise.errors_left import AT_MOST
from estimator.diagnosis.noise.estimation import Noise, noise_of, with_offsets_of
from estimator.diagnosis.noise.outliers import without_outliers
from estimator.diagnosis.noise.refinement import measured_on, refinement_of, solved_on
from estimator.diagnosis.search.candidate import Candidate
from estimator.diagnosis.search.context import Context
from estimator.diagnosis.search.rough_fit import rough_fit
from estimator.diagnosis.settings import DiagnosisSettings, NoiseSettings
from estimator.errors import SolverError
from estimator.experiment import Experiment, check_same_mounting
from estimator.experiment.as_modelled import as_modelled
from estimator.fem.equilibrium.morph import beads_from_grasp
from estimator.fit.settings import FitSettings
from estimator.inference.channels import measured_rows
from estimator.inference.material_parameters import POISSON_RATIO

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Preparation:
    """A case before it is said what is left of the errors that rows share.

    Attributes
    ----------
    case : with the discretisation's corrections, and the noise where the most is left
    mechanics : of the baseline, without its states
    noise : what the files do not state of it
    at_grasp : of each experiment (n, c, k), what meshes make of the edges of the grasp, by one deviation
    corrected_at : where the corrections are those of
    cases : the case by what is left
    """

    case: Case
    mechanics: tuple[Mechanics, ...]
    noise: Noise
    at_grasp: tuple[FloatArray, ...]
    corrected_at: Hypothesis
    cases: CaseLeaving


def prepare(
    experiments: Sequence[Experiment], settings: DiagnosisSettings, material: FitSettings, executor: Executor
) -> tuple[Preparation, Linearisation]:
    """Fit the baseline to a case; return the case prepared, and the fit where the most is left.

    ``material`` tells the baseline's law, and what is known of its parameters beforehand.

    Raises
    ------
    InputError
        The experiments are not of one mounting, or the phantom cannot be meshed.
    FitError
        The measured forces do not oppose the motion.
    SolverError
        A load step has no equilibrium.
    """
    check_same_mounting(experiments)
    modelled = map(as_modelled, experiments)
    ordered = tuple(sorted(modelled, key=lambda experiment: experiment.order))
    rough = rough_fit(ordered, material)
    finer = [
        executor.submit(
            channels_at,
            experiment,
            rough,
            measured_on,
            few_poses(experiment, settings.noise.corrected_states),
        )
        for experiment in ordered
    ]
    uncorrected, mechanics = _uncorrected(ordered, settings, rough)
    corrections = []
    for one, future in zip(mechanics, finer, strict=True):
        fine = future.result()
        corrections.append(
            correction_along(one.solution.load_steps.experiment, channels_met(one, fine), fine)
        )
    corrected = replace(uncorrected, corrections=tuple(corrections))
    predicted = predictions(corrected, mechanics, rough)
    cleaned = without_outliers(ordered, _misfits(corrected, predicted), settings.noise)
    corrected = replace(corrected, experiments=cleaned)
    mechanics = [_measured_as(one, experiment) for one, experiment in zip(mechanics, cleaned, strict=True)]
    noise = noise_of(cleaned, _misfits(corrected, predicted), settings.noise)
    at_grasp = left_at_grasp(mechanics, rough, corrections, settings.noise)
    shared = _shared(mechanics, corrections, noise, at_grasp, settings.noise)
    roughly = CaseLeaving(corrected, shared)(AT_MOST)
    begun = linearisation_of(roughly, rough, mechanics)
    baseline = refit(roughly, rough, begun, settings.noise.evaluations_of_baseline, solved_by(executor))
    # By the rough fit's E experiments would differ more than by their zeros.
    noise = with_offsets_of(noise, cleaned, _misfits(corrected, baseline.predicted), settings.noise)
    shared = _shared(mechanics, corrections, noise, at_grasp, settings.noise)
    modulus = baseline.hypothesis.youngs_modulus
    loads = tuple(
        GripLoad(without_noise(experiment.wrench, p[:, :6], settings.solver.load_waves), p[:, :6] / modulus)
        for experiment, p in zip(cleaned, baseline.predicted, strict=True)
    )
    cases = CaseLeaving(replace(corrected, loads=loads), shared)
    light = tuple(one.without_states() for one in mechanics)
    preparation = Preparation(cases.case, light, noise, tuple(at_grasp), rough, cases)
    return preparation, in_another_case(baseline, roughly, cases(AT_MOST))


def corrected_at(preparation: Preparation, fit: Linearisation, executor: Executor) -> Preparation:
    """Return the preparation with the discretisation error at a fit, where that is far from where it is known.

    Nearly incompressible tissue has much more of it, and where something is amiss the baseline's ν may be far off; and
    a bead that a cause puts elsewhere beside the rim of the grasp has another. Without an equilibrium on one of the
    meshes it stays as it is.
    """
    # What ends within elements is refitted on a mesh that follows it; ours all miss it alike.
    hypothesis = fit.hypothesis.without_small_regions
    if not _is_far(preparation, hypothesis):
        return preparation
    case, settings = preparation.case, preparation.case.settings.noise
    jobs = [
        [
            executor.submit(
                channels_at,
                experiment,
                hypothesis,
                meshed,
                poses_at_rest_and_few(mechanics, settings.corrected_states),
            )
            for meshed in (solved_on, measured_on)
        ]
        for experiment, mechanics in zip(case.experiments, fit.mechanics, strict=True)
    ]
    try:
        solved = [[job.result() for job in of_experiment] for of_experiment in jobs]
    except SolverError:
        return preparation
    corrections = tuple(
        correction_along(one, coarse, fine)
        for one, (coarse, fine) in zip(case.experiments, solved, strict=True)
    )
    refinement = refinement_of(case.experiments[0])
    now, before = (
        edge_deviation(one, refinement, settings) for one in (hypothesis, preparation.corrected_at)
    )
    grown = now / before
    at_grasp = tuple(grown * one for one in preparation.at_grasp)
    shared = _shared(preparation.mechanics, corrections, preparation.noise, at_grasp, settings)
    corrected = replace(case, corrections=corrections)
    return replace(
        preparation,
        case=corrected,
        at_grasp=at_grasp,
        corrected_at=hypothesis,
        cases=CaseLeaving(corrected, shared),
    )


def corrected_at_best(
    preparation: Preparation, context: Context, candidates: Sequence[Candidate], none: float
) -> Preparation:
    """Return the preparation with the discretisation error of the best candidate, where that is nearly the truth.

    It surely beats "none", and leaves little beyond noise: another cause beside it would lead elsewhere.

    Parameters
    ----------
    context : in which the candidates were refitted
    candidates : the most probable first
    none : log evidence of the baseline
    """
    case, settings = context.case, context.settings
    for best in candidates[:1]:
        values = sum(len(residual) for residual in best.fit.residual)
        little = best.fit.chi2 <= settings.noise.nearly_noise * values * white_floor(case) ** 2
        if little and best.log_evidence >= none + settings.search.close:
            preparation = corrected_at(preparation, best.fit, context.executor)
    return preparation


def _is_far(preparation: Preparation, hypothesis: Hypothesis) -> bool:
    known, settings = preparation.corrected_at, preparation.case.settings.noise
    before, after = (POISSON_RATIO.transform.internal_of(one.poisson_ratio) for one in (known, hypothesis))
    return abs(after - before) >= settings.far_in_ratio or _moves_beads_at_rim(preparation, hypothesis)


def _moves_beads_at_rim(preparation: Preparation, hypothesis: Hypothesis) -> bool:
    known, settings = preparation.corrected_at, preparation.case.settings.noise
    problem, experiment = preparation.case.problem, preparation.case.experiments[0]
    there, here = (beads_from_grasp(one.problem(problem)) for one in (known, hypothesis))
    beside = np.minimum(here, there) < beside_rim_m(experiment, settings)
    # Tissue 0.4 mm from the rim that had been taken for gripped left 0.2 mm, and a bead misread.
    return bool(np.any(np.abs(here - there)[beside] > settings.far_at_rim_m))


def _shared(
    mechanics: Sequence[Mechanics],
    corrections: Sequence[FloatArray],
    noise: Noise,
    at_grasp: Sequence[FloatArray],
    settings: NoiseSettings,
) -> list[CorrelatedErrors]:
    return [
        correlated_errors_of(one, correction, noise, settings, left)
        for one, correction, left in zip(mechanics, corrections, at_grasp, strict=True)
    ]


def _misfits(case: Case, predicted: Sequence[FloatArray]) -> list[FloatArray]:
    """Return measured less predicted (n, 6 + 3m) of each experiment in units of the noise, NaN where not measured."""
    return [
        (measured_rows(experiment) - channels) / whitening.deviation
        for experiment, channels, whitening in zip(case.experiments, predicted, case.whitenings, strict=True)
    ]


def _measured_as(mechanics: Mechanics, experiment: Experiment) -> Mechanics:
    """Return the same mechanics of an experiment of which less was measured."""
    solution = mechanics.solution
    load_steps, motion = solution.load_steps, solution.motion
    return replace(
        mechanics,
        solution=replace(
            solution,
            load_steps=replace(load_steps, experiment=experiment),
            motion=replace(motion, experiment=experiment),
        ),
    )


def _uncorrected(
    experiments: tuple[Experiment, ...], settings: DiagnosisSettings, hypothesis: Hypothesis
) -> tuple[Case, list[Mechanics]]:
    """Set up a case whose discretisation error is not known yet, and its mechanics under a hypothesis."""
    problem = solved_on(experiments[0])
    zeros = tuple(np.zeros((len(e.time), 6 + 3 * len(e.fiducials_rest))) for e in experiments)
    loads = tuple(GripLoad.none(len(e.time)) for e in experiments)
    setup = Setup(experiments, problem, loads, settings=settings)
    few = [load_steps_of_few(experiment, settings.noise.corrected_states) for experiment in experiments]
    solutions = solve_case(setup, hypothesis, every=settings.solver.poses_apart, besides=few)
    mechanics = [mechanics_of(solution) for solution in solutions]
    whitenings = tuple(
        correlated_errors_of(one, zero, Noise(), settings.noise).whitening()
        for one, zero in zip(mechanics, zeros, strict=True)
    )
    return Case(experiments, problem, loads, zeros, whitenings, settings=settings), mechanics
