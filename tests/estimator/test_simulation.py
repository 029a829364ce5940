"""Simulated experiments: any effect of the catalogue on any material, as its sensors would have seen it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import SMALL_BLOCK, turning_pull, with_rows

from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import mechanics_of, solve_case
from estimator.diagnosis.sensitivity.readings import channels, predicted_readings
from estimator.effects.catalogue import CATALOGUE, LABELS
from estimator.errors import InputError
from estimator.experiment import Experiment, check_experiment
from estimator.fem.discretisation.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean, Yeoh
from estimator.materials.material import make_material
from estimator.simulation.acting import ActingEffect, catalogue_text, read_effect
from estimator.simulation.simulate import Resolution, simulate_case
from estimator.simulation.truth import truth_of

FloatArray = NDArray[np.float64]

TINY = Resolution(Grading(6e-3, 10e-3, 20e-3, 3.0, 1), "hex27")
TISSUE = make_material(NeoHookean(), 15e3, 0.45)
NO_NOISE = replace(SMALL_BLOCK.sensor, tool_mass=0.35, tool_centre=(0.0, 0.0, 0.06))
# What has no usual size is named.
NAMED = {
    "gripper_slip": ",threshold=0.3",
    "fiducial_misread": ",bead=3",
    "fiducial_mislabel": ",first=1,second=2,order=1,time=1.5",
}
# Where the usual size of the first amplitude does too little on this path, or takes many small steps.
# What plates do to a block that they press is in test_platen_friction.py.
BETWEEN_PLATES = {effect.label for effect in CATALOGUE if effect.needs_platens}
SIZES = {"gravity_sag": "=0.1", "motion_direction": "=rotation_z=0.04", "force_crosstalk": "=0.1"}
# A path that turns about an oblique axis, and comes back: there no effect hides.
POSES = turning_pull(SMALL_BLOCK, 6e-3, np.array([0.2, 0.1, 0.3]), 2)


def planned(order: int = 1) -> Experiment:
    poses = [
        replace(POSES[0], position=np.array(SMALL_BLOCK.grasp.centre), rotation=POSES[0].rotation.identity()),
        *POSES,
        POSES[0],
    ]
    nothing = np.zeros((len(poses), 6)), np.zeros((len(poses), len(SMALL_BLOCK.fiducials_rest), 3))
    rest = replace(SMALL_BLOCK, sensor=replace(NO_NOISE, position_std=1e-7))
    rows = with_rows(rest, poses, *nothing)
    return replace(
        rows,
        order=order,
        phase=("hold", "hold", "hold", "return_hold"),
        step=np.arange(4),
        time=4.0 * np.arange(4),
    )


def seen(*effects: str, seed: int = 0) -> FloatArray:
    """Wrench and fiducials side by side (n, 6 + 3m)."""
    acting = [read_effect(text) for text in effects]
    (one,) = simulate_case([planned()], TISSUE, seed, acting, resolution=TINY)
    return np.hstack([one.wrench, one.fiducials.reshape(len(one.time), -1)])


@pytest.fixture(scope="module")
def null() -> FloatArray:
    return seen()


@pytest.mark.parametrize("label", [label for label in LABELS if label not in BETWEEN_PLATES])
def test_every_effect_of_the_catalogue_acts_and_vanishes_with_its_amplitude(
    label: str, null: FloatArray
) -> None:
    given = NAMED.get(label, "")
    sensor = planned().sensor
    noise = np.array([sensor.force_std] * 3 + [sensor.torque_std] * 3 + [sensor.fiducial_std] * 27)
    change = (seen(label + SIZES.get(label, "") + given) - null) / noise
    assert np.isfinite(change).all()
    assert np.linalg.norm(change) > 1.0
    first = read_effect(label + given).effect.amplitudes[0].name
    absent = (seen(f"{label}={first}=0{given}") - null) / noise
    assert np.linalg.norm(absent) < 0.02


def test_a_gripper_that_yields_moves_by_the_load_that_its_motion_makes(null: FloatArray) -> None:
    """As far as if it had been told to move that much less."""
    compliance = 0.003
    yielding = seen(f"gripper_compliance={compliance}")
    one = planned()
    bare = replace(one.sensor, force_std=1e-12, torque_std=1e-12, fiducial_std=1e-12, position_std=0.0)
    exact = replace(one, sensor=bare)
    (found,) = simulate_case(
        [exact], TISSUE, 0, [read_effect(f"gripper_compliance={compliance}")], resolution=TINY
    )
    moved = replace(exact, position=exact.position + compliance * found.wrench[:, :3])
    (told,) = simulate_case([moved], TISSUE, 0, resolution=TINY)
    np.testing.assert_allclose(found.wrench[:, :3], told.wrench[:, :3], atol=3e-4)
    assert np.abs(yielding[:, 0]).max() < 0.9 * np.abs(null[:, 0]).max()


def test_the_diagnosis_explains_a_simulated_effect_by_that_effect_and_not_without_it() -> None:
    """χ² of the hypothesis that holds the truth, and of the baseline, by the diagnosis' own forward model."""
    acting = [read_effect("force_axis_gain:fx=0.2"), read_effect("inhomogeneity=0.8,radius=0.01")]
    (experiment,) = simulate_case([planned()], TISSUE, 3, acting, resolution=TINY)
    check_experiment(experiment)
    problem = mesh_experiment(experiment, TINY.grading, TINY.kind)
    sensor = experiment.sensor
    noise = np.array([sensor.force_std] * 3 + [sensor.torque_std] * 3 + [sensor.fiducial_std] * 27)
    measured = np.hstack([experiment.wrench, experiment.fiducials.reshape(4, -1)])

    def misfit(truth_acting: list[ActingEffect]) -> float:
        truth = truth_of(TISSUE, truth_acting)
        (solution,) = solve_case(Setup([experiment], problem, [GripLoad.none(4)]), truth)
        predicted = channels(predicted_readings(mechanics_of(solution), truth, np.zeros(measured.shape)))
        return float(np.mean(((measured - predicted) / noise) ** 2))

    assert 0.6 < misfit(acting) < 1.5
    assert misfit([]) > 5.0


def test_what_the_tissue_remembers_goes_on_to_the_next_experiment() -> None:
    effect = [read_effect("stress_softening=0.4")]
    first, second = simulate_case([planned(1), planned(2)], TISSUE, 0, effect, resolution=TINY)
    assert abs(second.wrench[1, 0]) < abs(first.wrench[1, 0]) - 2 * first.sensor.force_std


def test_any_law_carries_effects_too(null: FloatArray) -> None:
    stiffer = make_material(Yeoh(terms=2), 15e3, 0.45, [0.5])
    (one,) = simulate_case([planned()], stiffer, 0, [read_effect("camera_scale=0.01")], resolution=TINY)
    assert abs(one.wrench[2, 0]) > abs(null[2, 0]) * 1.01


def test_the_seed_alone_draws_the_noise() -> None:
    np.testing.assert_array_equal(seen(seed=4), seen(seed=4))
    assert not np.array_equal(seen(seed=4), seen(seed=5))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "slip=1",
            "no effect is called 'slip'; did you mean gripper_slip; the effects are strain_stiffening,",
        ),
        ("gripper_slip:sudden=1", "has no form 'sudden'; it has gradual, creeping, by_axis, jump"),
        (
            "gripper_slip=0.01",
            "needs threshold=VALUE; it takes slip_per_force (m/N, usually 0.01), threshold (N,",
        ),
        ("camera_scale=much", "'much' is no finite number"),
        ("camera_scale=-0.9", "outside [-0.5, inf]"),
        ("camera_scale=0.01,colour=1", "has no parameter 'colour'; it takes scale_error"),
        ("camera_scale=0.01,0.02", "'0.02' has no name"),
    ],
)
def test_an_effect_that_cannot_be_read_is_told_in_one_line(text: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        read_effect(text)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_bead_that_is_not_there_is_told_in_one_line() -> None:
    with pytest.raises(InputError, match="9 fiducials are numbered 0 to 8"):
        simulate_case([planned()], TISSUE, 0, [read_effect("fiducial_misread=1e-3,bead=9")], resolution=TINY)


def test_the_list_of_effects_names_every_form_with_its_units() -> None:
    lines = catalogue_text().splitlines()
    assert [line.split(": it takes")[0] for line in lines] == [effect.name for effect in CATALOGUE]
    assert any(line.startswith("gripper_slip:gradual: it takes slip_per_force (m/N") for line in lines)
