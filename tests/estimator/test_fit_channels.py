"""Whatever was measured, an estimation answers within its intervals or says in one line what is missing."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from retraction_cases import (
    SMALL_BLOCK,
    follow,
    measured_only,
    of_rows,
    recorded,
    straight_pull,
    turning_pull,
    with_some_dropped,
)

from estimator.errors import EstimatorError, FitError
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import observe
from estimator.fit.estimate import estimate
from estimator.fit.result import Estimate, ParameterEstimate
from estimator.fit.settings import FitSettings
from estimator.forward.meshing import mesh_experiment
from estimator.inference.free_parameter import NormalPrior
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

TRUTH = Material(NeoHookean(), 12e3, 0.46)
# What generates the measurements and what fits them: the same mesh, so that every difference is the channels'.
GRADING = Grading(grasp_m=4e-3, anchor_m=8e-3, largest_m=20e-3, growth=2.0, layers=1)
PATHS = (
    straight_pull(SMALL_BLOCK, 0.012, 4),
    turning_pull(SMALL_BLOCK, 0.009, np.radians([25.0, 0, 10.0]), 4),
)
# A misfit by chance of so many deviations is none that anybody meets.
SURELY = 4.5


def coarse(experiment: Experiment) -> RetractionProblem:
    return mesh_experiment(experiment, GRADING)


@pytest.fixture(scope="module")
def whole() -> list[Experiment]:
    """A pull and a twist of one block, with everything measured."""
    rng = np.random.default_rng(3)
    problem = coarse(SMALL_BLOCK)
    rest = EquilibriumSolver(problem).rest(TRUTH)
    found = []
    for order, path in enumerate(PATHS, start=1):
        states = [rest, *follow(problem, TRUTH, path)]
        seen = [observe(problem, state) for state in states]
        poses = [state.pose for state in states]
        experiment = recorded(SMALL_BLOCK, poses, seen, rng, rows=2)
        found.append(replace(experiment, order=order, name=f"retraction {order}"))
    return found


def fitted(experiments: list[Experiment], asked: FitSettings | None = None) -> Estimate:
    return estimate(experiments, settings=asked or FitSettings(nuisances=WITHOUT_MESH), mesh=coarse)


WITHOUT_MESH = frozenset({"tare", "rest_positions", "gripper_position"})


def holds(found: ParameterEstimate, truth: float) -> bool:
    """Whether the truth is no farther off than chance has it; an interval is of 1.96 deviations to each side."""
    (low, high), wide = found.interval95, SURELY / 1.96
    return found.value - wide * (found.value - low) <= truth <= found.value + wide * (high - found.value)


def holds_truth(fit: Estimate) -> bool:
    # ν is told on a scale on which its interval is not symmetric: beyond its ends the scale is stretched further.
    ratio = fit.poisson_ratio
    internal = [-np.log1p(-2 * value) for value in (*ratio.interval95, ratio.value, TRUTH.poisson_ratio)]
    far = abs(internal[3] - internal[2]) / max((internal[1] - internal[0]) / (2 * 1.96), 1e-12)
    return holds(fit.youngs_modulus, TRUTH.youngs_modulus) and bool(far < SURELY)


@pytest.mark.parametrize(
    ("wrench", "beads", "axes"),
    [
        ([0], list(range(9)), [0, 1]),
        ([0, 1, 2], list(range(9)), [0, 1, 2]),
        ([0], [], []),
        ([3, 4, 5], list(range(9)), [0, 1, 2]),
        ([0, 5], [4], [1]),
    ],
    ids=[
        "one force axis, beads in the plane",
        "no torque",
        "one force axis alone",
        "torque alone",
        "one bead",
    ],
)
def test_any_channels_give_an_answer_that_holds_the_truth(
    whole: list[Experiment], wrench: list[int], beads: list[int], axes: list[int]
) -> None:
    fit = fitted([measured_only(one, wrench, beads, axes) for one in whole])
    assert holds_truth(fit)
    assert not fit.at_bound


def test_a_bead_that_comes_and_goes_counts_where_it_was_seen(whole: list[Experiment]) -> None:
    rng = np.random.default_rng(5)
    gaps = [
        replace(one, fiducials=np.where(rng.random(one.fiducials.shape) < 0.5, np.nan, one.fiducials))
        for one in whole
    ]
    assert holds_truth(fitted(gaps))


def test_experiments_may_differ_in_what_was_measured(whole: list[Experiment]) -> None:
    pull, twist = whole
    forces = measured_only(pull, [0], [], [])
    beads = measured_only(twist, [], list(range(9)), [0, 1, 2])
    assert holds_truth(fitted([forces, beads]))


def test_without_a_force_it_is_said_that_none_was_measured(whole: list[Experiment]) -> None:
    beads_alone = [measured_only(one, [], list(range(9)), [0, 1, 2]) for one in whole]
    with pytest.raises(FitError, match=r"^no force was measured, which alone tells Young's modulus; fix "):
        fitted(beads_alone)
    known = FitSettings(nuisances=WITHOUT_MESH, fixed={"youngs_modulus": TRUTH.youngs_modulus})
    assert holds_truth(fitted(beads_alone, known))
    supposed = FitSettings(nuisances=WITHOUT_MESH, priors={"youngs_modulus": NormalPrior(13e3, 2e3)})
    assert holds_truth(fitted(beads_alone, supposed))


def test_only_a_force_along_the_motion_is_blamed_for_its_sign(whole: list[Experiment]) -> None:
    reversed_force = [
        replace(measured_only(one, [0], [], []), wrench=-measured_only(one, [0], [], []).wrench)
        for one in whole
    ]
    with pytest.raises(FitError, match=r"does not oppose the motion .* axes of fx,"):
        fitted(reversed_force)
    rng = np.random.default_rng(1)
    quiet = [
        replace(
            one, wrench=np.where(np.isfinite(one.wrench), rng.normal(0.0, 1e-6, one.wrench.shape), np.nan)
        )
        for one in (measured_only(one, [1], [], []) for one in whole)
    ]
    message = ""
    try:
        fit = fitted(quiet)
    except FitError as refused:
        message = str(refused)
    else:
        assert fit.at_bound or fit.identifiability
    assert "sign" not in message


@settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_what_is_dropped_at_random_leaves_an_answer_or_one_line(
    whole: list[Experiment], data: st.DataObject
) -> None:
    kept = data.draw(with_some_dropped(whole))
    try:
        fit = fitted(kept)
    except EstimatorError as refused:
        assert "\n" not in str(refused)
        assert "sign" not in str(refused)
    else:
        assert holds_truth(fit)
        assert np.all(np.isfinite([fit.youngs_modulus.std, fit.poisson_ratio.std, fit.noise_ratio]))


def test_what_is_usual_moves_nothing_that_is_determined_and_stands_in_where_nothing_is(
    whole: list[Experiment],
) -> None:
    flat = FitSettings(nuisances=WITHOUT_MESH, priors={"poisson_ratio": None})
    supposed, without = fitted(whole), fitted(whole, flat)
    for name, parameter in supposed.parameters.items():
        assert abs(parameter.value - without.parameters[name].value) < 0.1 * parameter.std
    assert supposed.prior_shares["poisson_ratio"] < 0.02
    # A force along one motion alone tells one number.
    of_one = of_rows(measured_only(whole[0], [0], [], []), [0, 4, 9])
    open_question = fitted([of_one])
    assert open_question.prior_shares["poisson_ratio"] > 0.9
    low, high = open_question.poisson_ratio.interval95
    assert low < 0.25 and high > 0.49
    assert any("what is usual (0.40 to 0.49)" in sentence for sentence in open_question.identifiability)
