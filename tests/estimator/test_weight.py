"""Known weight: what it does to the tissue, its derivatives, and what a fit makes of it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK, block_at_rest, from_rest, recorded, turning_pull, with_rows
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import mechanics_of, solve_case
from estimator.diagnosis.sensitivity.readings import channels, predicted_readings
from estimator.errors import SolverError
from estimator.experiment import Box, Environment, Experiment, SensorNoise
from estimator.experiment.model import ForceZero
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import observe
from estimator.fem.equilibrium.settling import settled
from estimator.fit.estimate import estimate
from estimator.forward.meshing import mesh_experiment
from estimator.forward.model import ForwardModel
from estimator.inference.channels import channels_by, channels_by_pose, predicted_channels
from estimator.inference.extrapolation import extrapolated
from estimator.inference.material_parameters import law_parameters
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.simulation.acting import read_effect
from estimator.simulation.truth import truth_of

FloatArray = NDArray[np.float64]

TINY = Grading(grasp_m=6e-3, anchor_m=10e-3, largest_m=20e-3, growth=3.0, layers=1)
SOFT = Material(NeoHookean(), 6e3, 0.45)
HANGING = Environment((0.0, 3.0, -9.81), "none", "acts")
POSES = from_rest(SMALL_BLOCK, turning_pull(SMALL_BLOCK, 6e-3, np.array([0.2, 0.1, 0.3]), 3))


def block(environment: Environment, force_zero: ForceZero = "no_load") -> Experiment:
    sensor = replace(SMALL_BLOCK.sensor, force_zero=force_zero)
    nothing = np.zeros((len(POSES), 6)), np.zeros((len(POSES), len(SMALL_BLOCK.fiducials_rest), 3))
    return replace(with_rows(SMALL_BLOCK, POSES, *nothing), environment=environment, sensor=sensor)


def predicted(
    experiment: Experiment, material: Material, position: FloatArray | None = None
) -> list[FloatArray]:
    """The channels of every state, solved from nothing."""
    if position is not None:
        experiment = replace(experiment, position=experiment.position + position)
    model = ForwardModel(mesh_experiment(experiment, TINY), [experiment])
    (seen,) = model.predict(material, [range(len(POSES))])
    return [predicted_channels(seen[number]) for number in sorted(seen)]


def hanging_column(length: float) -> tuple[Experiment, Material, float]:
    """A column that hangs from above, its lower end held where it is at rest; its weight per area, Pa."""
    tissue = Material(NeoHookean(), 2e3, 0.0)
    upright = block_at_rest(
        (0.01, 0.01, length),
        Box((-0.005, -0.005, -length / 2), (0.005, 0.005, -length / 2)),
        SensorNoise(0.01, 1e-3, 1e-5, 1e-5),
        np.array([[0.0, 0.0, 0.0]]),
    )
    top = Box((-0.005, -0.005, length / 2), (0.005, 0.005, length / 2))
    environment = Environment((0.0, 0.0, -9.81), "none", "acts")
    return replace(upright, anchors=(top,), environment=environment), tissue, 1070 * 9.81 * length


@pytest.mark.parametrize("length", [0.05, 0.1])
def test_a_hanging_column_stretches_above_and_is_pressed_below_as_the_closed_form_says(length: float) -> None:
    """At ν = 0 its sides stay, and P = μ(λ − 1/λ) falls by the specific weight from the top to the bottom."""
    column, tissue, weight = hanging_column(length)
    solver = EquilibriumSolver(mesh_experiment(column, Grading(2e-3, 2e-3, 4e-3, 1.5, 1), "hex64"))
    state = settled(solver, tissue)
    mu, share = tissue.lame[0], np.linspace(0.0, 1.0, 20001)

    def stretch(at_top: float) -> FloatArray:
        stress = (at_top - weight * share) / mu
        return (stress + np.sqrt(stress**2 + 4.0)) / 2.0

    at_top = brentq(lambda stress: float(np.trapezoid(stretch(stress) - 1.0, share)), 0.0, weight)
    seen = observe(solver.problem, state)
    middle = -length * float(np.trapezoid((stretch(at_top) - 1.0)[:10001], share[:10001]))
    # The lower end is pressed: the tissue pushes the gripper down.
    assert seen.wrench[2] == pytest.approx(1e-4 * (at_top - weight), rel=1e-5)
    assert seen.fiducials[0, 2] == pytest.approx(middle, rel=1e-4)
    assert middle < -0.02 * length


def test_the_gripper_and_the_anchors_carry_all_of_the_weight() -> None:
    problem = mesh_experiment(block(HANGING), TINY)
    solver = EquilibriumSolver(problem)
    pose = POSES[-1]
    # What the jaws hold is the tool's to carry.
    weight = 1070 * 0.048 * 0.03 * 0.01 * np.array(HANGING.gravity)
    for state in (settled(solver, SOFT), solver.solve(pose, SOFT, settled(solver, SOFT))):
        np.testing.assert_allclose(state.forces.sum(axis=0), -weight, rtol=1e-6, atol=1e-9)


def test_the_effect_of_unknown_weight_and_the_known_weight_are_one_load() -> None:
    """The effect's sensor was zeroed in the first row, with the tissue hanging."""
    carried = block(replace(HANGING, weight="left_out"), "first_row")
    hung = block(HANGING, "first_row")
    truths = truth_of(SOFT, [read_effect("gravity_sag:beads_undeformed=1")]), truth_of(SOFT, [])
    seen = []
    for experiment, truth in zip((carried, hung), truths, strict=True):
        setup = Setup([experiment], mesh_experiment(experiment, TINY), [GripLoad.none(len(POSES))])
        (solution,) = solve_case(setup, truth)
        nothing = np.zeros((len(POSES), 6 + 3 * len(experiment.fiducials_rest)))
        seen.append(channels(predicted_readings(mechanics_of(solution), truth, nothing)))
    np.testing.assert_allclose(seen[1], seen[0], atol=1e-8)
    assert np.abs(seen[0]).max() > 0.1
    np.testing.assert_allclose(np.array(predicted(hung, SOFT)), seen[0], atol=1e-8)


def test_the_effect_has_nothing_left_to_say_where_the_weight_is_known() -> None:
    experiment = block(HANGING)
    setup = Setup([experiment], mesh_experiment(experiment, TINY), [GripLoad.none(len(POSES))])
    forces = []
    for text in ("gravity_sag:beads_undeformed=1", "gravity_sag:beads_hanging=0.5", None):
        truth = truth_of(SOFT, [] if text is None else [read_effect(text)])
        (solution,) = solve_case(setup, truth)
        nothing = np.zeros((len(POSES), 6 + 3 * len(experiment.fiducials_rest)))
        forces.append(channels(predicted_readings(mechanics_of(solution), truth, nothing)))
    np.testing.assert_array_equal(forces[0], forces[2])
    np.testing.assert_array_equal(forces[1], forces[2])


@pytest.mark.parametrize("force_zero", ["no_load", "first_row"])
@pytest.mark.parametrize("parameter", ["youngs_modulus", "poisson_ratio", "x", "z"])
def test_the_derivatives_are_those_of_the_sagging_tissue(parameter: str, force_zero: ForceZero) -> None:
    experiment = block(HANGING, force_zero)
    model = ForwardModel(mesh_experiment(experiment, TINY), [experiment])
    (seen,) = model.predict(SOFT, [range(len(POSES))])
    if parameter in ("x", "z"):
        axis, step = "xz".index(parameter) * 2, 1e-6
        way = np.zeros((len(POSES), 3))
        way[1:, axis] = step
        around = [predicted(experiment, SOFT, sign * way) for sign in (1, -1)]
        slopes = {number: channels_by_pose(seen[number])[:, axis] for number in range(1, len(POSES))}
    else:
        step = 1e-4 * getattr(SOFT, parameter)
        changed = [replace(SOFT, **{parameter: getattr(SOFT, parameter) + sign * step}) for sign in (1, -1)]
        around = [predicted(experiment, one) for one in changed]
        slopes = {number: channels_by(seen[number], parameter) for number in range(len(POSES))}
    for number, slope in slopes.items():
        numeric = (around[0][number] - around[1][number]) / (2 * step)
        for part in (slice(0, 3), slice(3, 6), slice(6, None)):
            size = np.abs(numeric[part]).max()
            np.testing.assert_allclose(slope[part], numeric[part], atol=2e-4 * size + 1e-12)


def test_a_change_of_modulus_is_followed_to_second_order() -> None:
    experiment = block(HANGING)
    model = ForwardModel(mesh_experiment(experiment, TINY), [experiment])
    (seen,) = model.predict(SOFT, [range(len(POSES))])
    parameters = law_parameters(SOFT.law)
    before = {"youngs_modulus": SOFT.youngs_modulus, "poisson_ratio": SOFT.poisson_ratio}
    missed = []
    for factor in (1.1, 1.05):
        after = {**before, "youngs_modulus": factor * SOFT.youngs_modulus}
        exact = predicted(experiment, replace(SOFT, youngs_modulus=after["youngs_modulus"]))
        guessed = predicted_channels(extrapolated(seen[2], parameters, before, after))
        missed.append(np.linalg.norm((guessed - exact[2])[6:]))
    assert missed[1] < 0.3 * missed[0]


def test_tissue_too_soft_for_its_own_weight_ends_with_one_line() -> None:
    experiment = block(HANGING)
    solver = EquilibriumSolver(mesh_experiment(experiment, TINY))
    with pytest.raises(SolverError, match=r"at rest, no equilibrium under more than \d+ % of what acts"):
        settled(solver, replace(SOFT, youngs_modulus=1.0))


def mesh(experiment: Experiment) -> RetractionProblem:
    return mesh_experiment(experiment, TINY)


def measured(force_zero: ForceZero, loaded: bool, rng: np.random.Generator) -> Experiment:
    experiment = block(HANGING, force_zero)
    if loaded:
        experiment = replace(experiment, first_row="under_load")
    poses = POSES[1:] if loaded else POSES
    planned = with_rows(
        experiment,
        poses,
        np.zeros((len(poses), 6)),
        np.zeros((len(poses), *SMALL_BLOCK.fiducials_rest.shape)),
    )
    (seen,) = ForwardModel(mesh(experiment), [planned]).predict(SOFT, [range(len(poses))])
    rows = recorded(SMALL_BLOCK, poses, [seen[n] for n in range(len(poses))], rng)
    return replace(rows, environment=HANGING, sensor=experiment.sensor, first_row=experiment.first_row)


@pytest.mark.parametrize(
    ("force_zero", "loaded"),
    [("no_load", False), ("first_row", False), ("no_load", True), ("first_row", True)],
)
def test_an_estimate_of_sagging_tissue_holds_the_truth(force_zero: ForceZero, loaded: bool) -> None:
    experiment = measured(force_zero, loaded, np.random.default_rng(5))
    found = estimate([experiment], mesh=mesh, finer_mesh=mesh).parameters
    for name, true in (("youngs_modulus", SOFT.youngs_modulus), ("poisson_ratio", SOFT.poisson_ratio)):
        low, high = found[name].interval95
        assert low < true < high
        assert high - low < 0.12 * true


def test_weight_that_is_left_out_puts_the_estimate_off() -> None:
    experiment = measured("no_load", False, np.random.default_rng(5))
    left_out = replace(experiment, environment=replace(HANGING, weight="left_out"))
    found = estimate([left_out], mesh=mesh, finer_mesh=mesh)
    assert found.noise_ratio > 5.0


def test_a_zero_taken_under_load_turns_with_the_sensor() -> None:
    """The first row is turned already: what is taken off later is turned by what came since."""
    turned = [GripperPose(p.position, Rotation.from_euler("x", 0.2) * p.rotation) for p in POSES]
    experiment = replace(
        with_rows(block(HANGING, "first_row"), turned, np.zeros((4, 6)), np.zeros((4, 9, 3))),
        first_row="under_load",
    )
    absolute = replace(experiment, sensor=replace(experiment.sensor, force_zero="no_load"))
    setup = Setup([experiment], mesh_experiment(experiment, TINY), [GripLoad.none(4)])
    zeroed, felt = predicted(experiment, SOFT), predicted(absolute, SOFT)
    np.testing.assert_allclose(zeroed[0][:6], 0.0, atol=1e-12)
    since = turned[-1].rotation * turned[0].rotation.inv()
    np.testing.assert_allclose(zeroed[-1][:3], felt[-1][:3] - since.apply(felt[0][:3]), atol=1e-12)
    truth = truth_of(SOFT, [])
    (solution,) = solve_case(setup, truth)
    read = channels(predicted_readings(mechanics_of(solution), truth, np.zeros((4, 33))))
    np.testing.assert_allclose(read, zeroed, atol=1e-8)
