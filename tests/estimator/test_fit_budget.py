"""Uncertainty budgets beside estimates whose measurements have the errors that the budget is of."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import chi2

from benchmarks.budget import PARAMETERS, drawn, fitted, planned_pull, recorded
from estimator.errors import InputError, SolverError
from estimator.experiment import Experiment
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fit.budget.budget import Budget, Line
from estimator.fit.budget.source import Origin
from estimator.fit.budget.systematic import SYSTEMATIC, Stated
from estimator.fit.estimate import estimate
from estimator.fit.losses import loss_named
from estimator.fit.nuisances import FORCE_GAIN, TARE, USUAL
from estimator.fit.result import Estimate
from estimator.fit.settings import FitSettings
from estimator.forward.meshing import mesh_experiment
from estimator.inference.whitening import Whitening, inverse_root
from estimator.materials import law_named

_COARSE = Grading(grasp_m=6e-3, anchor_m=12e-3, largest_m=25e-3, growth=3.0, layers=1)


@pytest.fixture(scope="module")
def measured() -> Experiment:
    return recorded(planned_pull())


@pytest.fixture(scope="module")
def exact(measured: Experiment) -> Estimate:
    return fitted(measured, stated=Stated())


def with_budget(*experiments: Experiment, **changes: object) -> Estimate:
    settings = FitSettings(**{"budget": Stated(), **changes})  # type: ignore[arg-type]
    return estimate(
        experiments,
        settings=settings,
        mesh=lambda one: mesh_experiment(one, _COARSE),
        finer_mesh=lambda one: mesh_experiment(one, replace(_COARSE, layers=2)),
    )


@pytest.fixture(scope="module")
def usual(measured: Experiment) -> Estimate:
    """What a fit tells that is asked for nothing in particular."""
    return with_budget(measured)


def budget_of(found: Estimate) -> Budget:
    assert found.budget is not None
    return found.budget


def line(found: Estimate, name: str) -> Line:
    return next(one for one in budget_of(found).lines if one.source.name == name)


def names(found: Estimate) -> list[str]:
    return [one.source.name for one in budget_of(found).lines]


def assert_known_is_what_the_estimate_tells(found: Estimate) -> None:
    for name, told in budget_of(found).known.items():
        assert told == pytest.approx(found.parameters[name].std, rel=2e-3)


def test_the_contributions_add_up_to_the_whole(exact: Estimate) -> None:
    budget = budget_of(exact)
    for name in PARAMETERS:
        assert sum(one.share[name] for one in budget.lines) == pytest.approx(1.0)
        assert sum(one.share[name] for one in budget.devices) == pytest.approx(1.0)
        squares = sum(one.contribution[name] ** 2 for one in budget.lines)
        assert budget.combined[name] == pytest.approx(np.sqrt(squares))
        assert budget.expanded[name] == pytest.approx(1.96 * budget.combined[name], rel=1e-4)


def test_what_the_fit_knows_of_is_the_deviation_that_it_tells(exact: Estimate) -> None:
    assert_known_is_what_the_estimate_tells(exact)


@pytest.mark.parametrize(
    "changes",
    [
        {"nuisances": frozenset()},
        {"nuisances": USUAL},
        {"nuisances": USUAL | {FORCE_GAIN.name}},
        {"priors": {"poisson_ratio": None}},
        {"fixed": {"poisson_ratio": 0.45}},
        {"objective": "paper"},
        {"law": law_named("yeoh2"), "fixed": {"poisson_ratio": 0.45}},
        {"loss": loss_named("huber"), "intervals": "profile"},
    ],
    ids=[
        "no nuisance",
        "with the mesh",
        "a gain",
        "no prior",
        "ν known",
        "the paper's objective",
        "a law's shape",
        "robust, by profiles",
    ],
)
def test_so_it_is_whatever_the_fit_was_asked_for(measured: Experiment, changes: dict[str, object]) -> None:
    assert_known_is_what_the_estimate_tells(with_budget(measured, **changes))


def test_scatter_beyond_the_noise_is_a_source_of_its_own(measured: Experiment) -> None:
    rng, sensor = np.random.default_rng(1), measured.sensor
    wrench = measured.wrench + 2 * sensor.wrench_std * rng.normal(size=measured.wrench.shape)
    fiducials = measured.fiducials + 2 * sensor.bead_std * rng.normal(size=measured.fiducials.shape)
    found = with_budget(replace(measured, wrench=wrench, fiducials=fiducials))
    assert found.inflation > 1.05
    assert line(found, "misfit").source.size == pytest.approx(np.sqrt(found.inflation**2 - 1))
    assert_known_is_what_the_estimate_tells(found)


@pytest.mark.parametrize(
    "name",
    [
        "force_gain",
        "gripper_travel",
        "camera_scale",
        "thickness",
        "force_latency",
        "tool_mass",
        "prior_poisson_ratio",
    ],
)
def test_an_error_of_one_unknown_moves_the_estimate_by_its_sensitivity(exact: Estimate, name: str) -> None:
    seed = 2
    amount = float(np.random.default_rng(seed).normal())
    moved, told = drawn([name], seed), line(exact, name)
    for parameter in PARAMETERS:
        change = moved[parameter] - exact.parameters[parameter].value
        negligible = 2e-3 * budget_of(exact).combined[parameter]
        assert abs(change) == pytest.approx(
            abs(amount) * told.contribution[parameter], rel=0.05, abs=negligible
        )
        assert told.contribution[parameter] == pytest.approx(told.sensitivity[parameter] * told.source.size)


@pytest.mark.parametrize("name", ["force_tare", "bead", "motion_direction"])
def test_an_error_of_several_unknowns_scatters_estimates_by_its_contribution(
    exact: Estimate, name: str
) -> None:
    draws = [drawn([name], [seed, 7]) for seed in range(6)]
    low, high = chi2.ppf([1e-4, 1 - 1e-4], len(draws))
    for parameter in PARAMETERS:
        told = line(exact, name).contribution[parameter]
        if told > 0.02 * budget_of(exact).combined[parameter]:
            moved = np.array([one[parameter] for one in draws]) - exact.parameters[parameter].value
            assert low < float(np.sum(moved**2)) / told**2 < high


def test_a_tare_contributes_more_where_the_fit_does_not_look_for_it(
    measured: Experiment, usual: Estimate
) -> None:
    told = usual
    untold = with_budget(measured, nuisances=USUAL - {TARE.name})
    assert line(told, "force_tare").source.known
    assert not line(untold, "force_tare").source.known
    modulus = "youngs_modulus"
    assert (
        line(untold, "force_tare").contribution[modulus]
        > 1.1 * line(told, "force_tare").contribution[modulus]
    )
    assert budget_of(untold).known[modulus] < budget_of(told).known[modulus]


def test_what_experiments_share_does_not_average_out_and_what_is_their_own_does(
    measured: Experiment, usual: Estimate
) -> None:
    once, twice = usual, with_budget(measured, replace(measured, order=2, name="again"))
    modulus = "youngs_modulus"
    for name, factor in (
        ("force_gain", 1.0),
        ("thickness", 1.0),
        ("force", 0.5**0.5),
        ("force_tare", 0.5**0.5),
    ):
        before, after = line(once, name).contribution[modulus], line(twice, name).contribution[modulus]
        assert after == pytest.approx(factor * before, rel=0.02), name


def test_a_gain_that_the_fit_estimates_is_listed_once_and_takes_no_other_size(measured: Experiment) -> None:
    floating = USUAL | {FORCE_GAIN.name}
    found = with_budget(measured, nuisances=floating)
    assert names(found).count("force_gain") == 1
    assert line(found, "force_gain").source.known
    assert line(found, "force_gain").contribution["youngs_modulus"] == pytest.approx(150.0, rel=0.02)
    with pytest.raises(InputError, match="uncertainty force_gain: the fit estimates it"):
        with_budget(measured, nuisances=floating, budget=Stated({"force_gain": 0.005}))


def test_a_stated_size_takes_the_place_of_what_is_assumed(measured: Experiment, usual: Estimate) -> None:
    stated = Stated(
        {"force_gain": 0.002}, {"force_gain": Origin("A", "certificate 12"), "bead": Origin("B", "design")}
    )
    found = with_budget(measured, budget=stated)
    ratio = (
        line(found, "force_gain").contribution["youngs_modulus"]
        / line(usual, "force_gain").contribution["youngs_modulus"]
    )
    assert ratio == pytest.approx(0.2)
    assert line(found, "force_gain").source.origin == Origin("A", "certificate 12")
    assert line(found, "bead").source.origin == Origin("B", "design")
    assert line(usual, "force_gain").source.origin.words.startswith("assumed: ")


def test_half_a_source_leaves_a_quarter_of_its_variance(exact: Estimate) -> None:
    budget = budget_of(exact)
    for one in (*budget.lines, *budget.devices):
        for name in PARAMETERS:
            whole = budget.combined[name] ** 2
            assert one.gone[name] ** 2 == pytest.approx(whole * (1 - one.share[name]), abs=1e-9 * whole)
            assert one.halved[name] ** 2 == pytest.approx(whole * (1 - 0.75 * one.share[name]))
    assert budget.first_to_improve("youngs_modulus").device == "force sensor"


def test_a_stream_is_late_only_for_what_was_measured_under_way(measured: Experiment) -> None:
    standing = replace(measured, phase=("hold",) * len(measured.phase))
    found = with_budget(standing)
    for name in ("force_latency", "camera_latency"):
        assert set(line(found, name).contribution.values()) == {0.0}


def test_an_error_with_which_nothing_can_be_solved_is_left_out_and_told(
    measured: Experiment, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unsolvable(*_: object) -> None:
        raise SolverError("no equilibrium")

    monkeypatch.setattr("estimator.fit.budget.assembly.changes_of_mechanics", unsolvable)
    found = with_budget(measured)
    assert "thickness of the phantom" in budget_of(found).left_out
    assert "thickness" not in names(found)
    assert "force_gain" in names(found)


def test_without_beads_and_torques_their_sources_are_not_listed(measured: Experiment) -> None:
    wrench = measured.wrench.copy()
    wrench[:, 3:] = np.nan
    found = with_budget(replace(measured, wrench=wrench, fiducials=np.full_like(measured.fiducials, np.nan)))
    assert not {"bead", "rest_positions", "torque", "torque_tare"} & set(names(found))
    assert_known_is_what_the_estimate_tells(found)


@pytest.mark.parametrize(
    ("sizes", "complaint"),
    [
        ({"wind": 1.0}, "no uncertainty is called 'wind'; there are force_gain, "),
        ({"force_gain": -0.1}, "uncertainty force_gain = -0.1: write a number that is not negative"),
        ({"force_gain": float("nan")}, "uncertainty force_gain = nan"),
        ({"force_gain": float("inf")}, "uncertainty force_gain = inf"),
    ],
)
def test_a_size_that_cannot_be_is_refused(sizes: dict[str, float], complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        Stated(sizes)


def test_the_names_of_all_errors_are_told_where_an_origin_has_none() -> None:
    with pytest.raises(InputError, match=r"no uncertainty is called 'wind'; .*position"):
        Stated({}, {"wind": Origin("B", "a guess")})


@pytest.mark.parametrize("name", SYSTEMATIC)
def test_an_error_of_no_size_is_no_effect(name: str) -> None:
    for acting in SYSTEMATIC[name].acting(0.0):
        for effect, values in acting:
            assert set(values) == {amplitude.name for amplitude in effect.amplitudes}
            assert not any(values.values())


NUMBERS = st.floats(-3.0, 3.0)


@given(
    arrays(float, (4, 2), elements=NUMBERS),
    arrays(float, 4, elements=NUMBERS),
    arrays(float, 4, elements=NUMBERS),
)
def test_the_derivative_by_values_is_that_by_whitened_ones(
    shared: np.ndarray, change: np.ndarray, by_whitened: np.ndarray
) -> None:
    seen = np.array([[True, False, True, True, True]])
    whitening = Whitening(seen, np.array([0.5, 1.0, 2.0, 3.0, 0.1]), np.zeros(5), *inverse_root(shared))
    values = np.zeros((1, 5, 1))
    values[seen, 0] = change
    through_whitened = float(by_whitened @ whitening.apply(values)[:, 0])
    by_value = whitening.derivative(by_whitened[None])[0]
    assert float(np.sum(by_value * values[..., 0])) == pytest.approx(through_whitened, abs=1e-9)
    assert by_value[0, 1] == 0.0
