"""Supports that hold some directions only, against closed forms of homogeneous states and against solved states."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from at_once import diagnosed_at_once
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from retraction_cases import COARSE_GRADING, block_at_rest, follow, with_rows
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from estimator.effects.catalogue import Catalogue, default_catalogue
from estimator.errors import InputError
from estimator.experiment import (
    Box,
    Environment,
    Experiment,
    Grasp,
    Phantom,
    Roller,
    SensorNoise,
    check_experiment,
    read_experiment,
    write_experiment,
)
from estimator.experiment.holds import AXES
from estimator.experiment.support import in_words
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium.observation import Observation, observe
from estimator.fit.estimate import estimate
from estimator.forward.meshing import mesh_experiment
from estimator.importing.bodies import cylinder_surface
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.simulation.simulate import Resolution, simulate_case
from estimator.surfaces.reading import surface_bounds
from estimator.surfaces.writing import write_stl

FloatArray = NDArray[np.float64]

SIZE = (0.03, 0.02, 0.01)
SENSOR = SensorNoise(force_std=2e-3, torque_std=2e-5, fiducial_std=2e-5, position_std=1e-6)
TINY = Grading(grasp_m=10e-3, anchor_m=10e-3, largest_m=20e-3, growth=3.0, layers=1)
CORNER = np.array(SIZE) / 2


def face(axis: int, side: int) -> Box:
    """The whole face of the block at one end of an axis, at −1 or 1."""
    lower, upper = -CORNER, CORNER.copy()
    (lower if side > 0 else upper)[axis] = side * CORNER[axis]
    (a, b, c), (d, e, f) = lower.tolist(), upper.tolist()
    return Box((a, b, c), (d, e, f))


def on_plates(axis: int, walls: tuple[int, ...], beads: FloatArray | None = None) -> Experiment:
    """Smooth plates at the lower end of each axis and at the upper of ``walls``; the one opposite ``axis`` moves."""
    moving = face(axis, 1)
    rest = block_at_rest(SIZE, moving, SENSOR, np.array([CORNER]) if beads is None else beads)
    plates = [Roller(face(n, -1), (AXES[n],)) for n in range(3)]
    plates += [Roller(face(n, 1), (AXES[n],)) for n in walls]
    grasp = replace(rest.grasp, directions=(AXES[axis],))
    return replace(rest, anchors=(), rollers=tuple(plates), grasp=grasp)


def nominal_stress(material: Material, stretches: FloatArray) -> FloatArray:
    """Of the Neo-Hookean law in the principal directions, Pa."""
    mu, lame = material.lame
    volume = float(np.prod(stretches))
    return np.asarray(mu * (stretches - 1 / stretches) + lame * (volume - 1) * volume / stretches)


def homogeneous(
    material: Material, axis: int, stretch: float, walls: tuple[int, ...]
) -> tuple[FloatArray, float]:
    """Stretches (3,) and nominal stress along ``axis``, Pa, with no stress where there is no wall."""
    loose = [n for n in range(3) if n != axis and n not in walls]

    def stretches(log_of_loose: FloatArray) -> FloatArray:
        found = np.ones(3)
        found[axis], found[loose] = stretch, np.exp(log_of_loose)
        return found

    def stress(log_of_loose: FloatArray) -> FloatArray:
        return nominal_stress(material, stretches(log_of_loose))[loose] / material.youngs_modulus

    found = np.zeros(len(loose))
    if loose:
        found = root(stress, -material.poisson_ratio * np.log(stretch) * np.ones(len(loose)), tol=1e-13).x
    return stretches(found), float(nominal_stress(material, stretches(found))[axis])


@settings(max_examples=12, deadline=None)
@given(
    axis=st.integers(0, 2),
    walls=st.integers(0, 2),
    stretch=st.floats(0.85, 1.3),
    poisson_ratio=st.floats(0.0, 0.495),
)
def test_uniaxial_plane_strain_and_confined_states_are_those_of_the_closed_forms(
    axis: int, walls: int, stretch: float, poisson_ratio: float
) -> None:
    """Uniaxial with no wall besides, plane strain with one, confined with two: then the slope is λ + 2μ at rest."""
    material = Material(NeoHookean(), 20e3, poisson_ratio)
    others = tuple(n for n in range(3) if n != axis)[:walls]
    planned = on_plates(axis, others)
    check_experiment(with_two_rows(planned))
    problem = mesh_experiment(planned, TINY)
    way = (stretch - 1) * SIZE[axis] * np.eye(3)[axis]
    pose = GripperPose(np.array(planned.grasp.centre) + way, Rotation.identity())
    (state,) = follow(problem, material, [pose])
    seen = observe(problem, state)
    stretches, stress = homogeneous(material, axis, stretch, others)
    area = float(np.prod(SIZE)) / SIZE[axis]
    force = -stress * area * np.eye(3)[axis]
    # The block widens away from the plates that stand, and the plate that moves is pressed where the tissue is.
    arm = (stretches - 1) * CORNER * (np.arange(3) != axis)
    weight = 20e3 * area
    np.testing.assert_allclose(seen.wrench[:3], force, atol=1e-8 * weight)
    np.testing.assert_allclose(seen.wrench[3:], np.cross(arm, force), atol=1e-8 * weight * max(SIZE))
    np.testing.assert_allclose(seen.fiducials[0], -CORNER + 2 * stretches * CORNER, atol=1e-9)


def test_a_confined_block_has_the_aggregate_modulus() -> None:
    material = Material(NeoHookean(), 20e3, 0.4)
    planned = on_plates(2, (0, 1))
    problem = mesh_experiment(planned, TINY)
    seen = observe(problem, EquilibriumSolver(problem).rest(material))
    mu, lame = material.lame
    assert seen.wrench_by_pose[2, 2] == pytest.approx(
        -(lame + 2 * mu) * SIZE[0] * SIZE[1] / SIZE[2], rel=1e-9
    )


def with_two_rows(rest: Experiment) -> Experiment:
    """Two rows in which nothing moves and nothing is felt."""
    pose = GripperPose(np.array(rest.grasp.centre), Rotation.identity())
    return with_rows(rest, [pose] * 2, np.zeros((2, 6)), np.zeros((2, *rest.fiducials_rest.shape)))


def leaning() -> Experiment:
    """Clamped on a part of its lower face, under a smooth plate: nothing about it is symmetric."""
    rest = on_plates(2, (), np.array([[0.004, 0.003, 0.001], CORNER]))
    part = Box((-0.015, -0.01, -0.005), (0.004, 0.002, -0.005))
    return replace(rest, anchors=(part,), rollers=(Roller(face(0, 1), ("x",)),))


def seen_at(problem: RetractionProblem, pose: GripperPose, poisson_ratio: float) -> Observation:
    material = Material(NeoHookean(), 20e3, poisson_ratio)
    (state,) = follow(problem, material, [pose], NewtonSettings(tolerance=1e-13))
    return observe(problem, state)


def channels(seen: Observation) -> FloatArray:
    return np.concatenate([seen.wrench, seen.fiducials.ravel()])


def test_what_a_sliding_gripper_feels_has_the_derivatives_of_solved_states() -> None:
    planned = leaning()
    problem = mesh_experiment(planned, COARSE_GRADING)
    centre = np.array(planned.grasp.centre) - 1e-3 * np.eye(3)[2]

    def posed(shift: FloatArray) -> GripperPose:
        return GripperPose(centre + shift[:3], Rotation.from_rotvec(shift[3:]))

    seen = seen_at(problem, posed(np.zeros(6)), 0.4)
    by_pose = np.concatenate([seen.wrench_by_pose, seen.fiducials_by_pose.reshape(-1, 6)])
    step = 1e-5
    for axis in range(6):
        ways = [step * sign * np.eye(6)[axis] for sign in (1, -1)]
        there, back = (channels(seen_at(problem, posed(way), 0.4)) for way in ways)
        quotient = (there - back) / (2 * step)
        for kind in (slice(0, 3), slice(3, 6), slice(6, None)):
            largest = np.abs(by_pose[kind]).max()
            np.testing.assert_allclose(by_pose[kind, axis], quotient[kind], atol=1e-5 * largest)
    by_ratio = np.concatenate([seen.wrench_by["poisson_ratio"], seen.fiducials_by["poisson_ratio"].ravel()])
    there, back = (channels(seen_at(problem, posed(np.zeros(6)), 0.4 + change)) for change in (1e-4, -1e-4))
    quotient = (there - back) / 2e-4
    for kind in (slice(0, 3), slice(3, 6), slice(6, None)):
        np.testing.assert_allclose(by_ratio[kind], quotient[kind], atol=1e-4 * np.abs(quotient[kind]).max())


@settings(max_examples=6, deadline=None)
@given(axis=st.integers(0, 2), stretch=st.floats(0.85, 1.2), loose=st.integers(0, 2))
def test_between_smooth_plates_a_block_stays_in_its_middle_and_nothing_pushes_it_aside(
    axis: int, stretch: float, loose: int
) -> None:
    """Without planes of symmetry it could drift and turn: whatever is left is pinned, and the pins bear nothing."""
    material = Material(NeoHookean(), 20e3, 0.45)
    planned = on_plates(axis, ())
    kept = [roller for roller in planned.rollers if roller.directions == (AXES[axis],)]
    if loose != axis:
        kept += [roller for roller in planned.rollers if roller.directions == (AXES[loose],)]
    planned = replace(planned, rollers=tuple(kept))
    assert in_words(with_two_rows(planned))
    problem = mesh_experiment(planned, TINY)
    way = (stretch - 1) * SIZE[axis] * np.eye(3)[axis]
    pose = GripperPose(np.array(planned.grasp.centre) + way, Rotation.identity())
    (state,) = follow(problem, material, [pose])
    stretches, stress = homogeneous(material, axis, stretch, ())
    force = -stress * float(np.prod(SIZE)) / SIZE[axis]
    assert observe(problem, state).wrench[axis] == pytest.approx(force, rel=1e-9)
    free = [n for n in range(3) if n not in (axis, loose)]
    grown = np.ptp(problem.body.mesh.points + state.displacement, axis=0)
    np.testing.assert_allclose(grown, stretches * SIZE, rtol=1e-9)
    middle = (problem.body.mesh.points + state.displacement).mean(axis=0)
    assert np.abs(middle[free]).max() < 1e-9


def test_half_a_block_on_its_plane_of_symmetry_is_half_of_the_block() -> None:
    whole = block_at_rest(SIZE, Box((0.009, -0.01, -0.005), (0.015, 0.01, 0.005)), SENSOR, np.zeros((0, 3)))
    half = block_at_rest(
        (SIZE[0], SIZE[1] / 2, SIZE[2]),
        Box((0.009, -0.005, -0.005), (0.015, 0.005, 0.005)),
        SENSOR,
        np.zeros((0, 3)),
    )
    plane = Box((-0.015, -0.005, -0.005), (0.015, -0.005, 0.005))
    half = replace(half, rollers=(Roller(plane, ("y",)),))
    material = Material(NeoHookean(), 20e3, 0.45)
    even = Grading(grasp_m=5e-3, anchor_m=5e-3, largest_m=5e-3, growth=1.0, layers=1)
    way = np.array([2e-3, 0.0, 1e-3])
    felt = []
    for planned in (whole, half):
        problem = mesh_experiment(planned, even)
        pose = GripperPose(np.array(planned.grasp.centre) + way, Rotation.identity())
        (state,) = follow(problem, material, [pose])
        felt.append(observe(problem, state).wrench)
    np.testing.assert_allclose(felt[1][[0, 2]], felt[0][[0, 2]] / 2, rtol=1e-9)


def simulated(planned: Experiment, ways: FloatArray) -> Experiment:
    """The plate moves by each of ``ways`` (n,) along z, m."""
    places = np.array(planned.grasp.centre) + np.outer(ways, [0.0, 0.0, 1.0])
    poses = [GripperPose(place, Rotation.identity()) for place in places]
    rows = len(ways)
    moved = with_rows(planned, poses, np.zeros((rows, 6)), np.zeros((rows, *planned.fiducials_rest.shape)))
    (seen,) = simulate_case(
        [moved], Material(NeoHookean(), 20e3, 0.42), 4, resolution=Resolution(TINY, "hex27")
    )
    return seen


def test_the_modulus_is_estimated_between_smooth_plates_and_read_back() -> None:
    seen = simulated(on_plates(2, ()), np.repeat([0.0, -2e-4, -5e-4, -1e-3], 3))
    found = estimate(
        [seen], mesh=lambda e: mesh_experiment(e, TINY), finer_mesh=lambda e: mesh_experiment(e, TINY)
    )
    low, high = found.parameters["youngs_modulus"].interval95
    assert low < 20e3 < high < 1.2 * low
    low, high = found.parameters["poisson_ratio"].interval95
    assert low < 0.42 < high < low + 0.1


def test_what_holds_some_directions_only_is_written_and_read(tmp_path: Path) -> None:
    planned = with_two_rows(on_plates(2, (0,)))
    write_experiment(planned, tmp_path / "plates")
    read = read_experiment(tmp_path / "plates")
    assert (read.rollers, read.grasp, read.anchors) == (planned.rollers, planned.grasp, ())


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (
            lambda e: replace(
                e,
                rollers=e.rollers[2:],
                environment=Environment((0.0, -9.81, 0.0), "none", weight="acts"),
            ),
            r"the weight acts, and nothing keeps the phantom from moving along x",
        ),
        (lambda e: replace(e, rollers=()), r"no \[\[anchor\]\]"),
        (lambda e: replace(e, rollers=(*e.rollers, Roller(face(2, 1), ("z",)))), r"stand and move along z"),
        (
            lambda e: replace(
                e, grasp=Grasp(Box((-0.015, -0.01, 0.0), (0.015, 0.01, 0.005)), (0, 0, 0.005), ("z",))
            ),
            r"tissue slides on a face: give a flat box",
        ),
        (
            lambda e: replace(e, quaternion_wxyz=np.array([[1, 0, 0, 0], [np.cos(0.1), np.sin(0.1), 0, 0]])),
            r"the gripper turns by 11\.5 degrees",
        ),
    ],
)
def test_a_body_that_is_loose_or_held_in_contradiction_is_refused_in_one_line(
    changed: Callable[[Experiment], Experiment], said: str
) -> None:
    planned = with_two_rows(on_plates(2, ()))
    with pytest.raises(InputError, match=said):
        check_experiment(changed(planned))


def test_a_diagnosis_between_smooth_plates_names_the_cause_and_none_of_anchors_that_are_not_there() -> None:
    everything = default_catalogue()
    labels = ("force_axis_gain", "camera_scale", "anchor_debonding", "anchor_compliance", "prestretch")
    few = tuple(one for one in everything.effects if one.label in labels and not one.elaborates)
    beads = 1e-3 * np.array([(x, y, z) for x in (-12.0, 0.0, 14.0) for y in (-7.0, 9.0) for z in (-3.0, 4.0)])
    ways = np.repeat([0.0, -3e-4, -6e-4, -1e-3, -1.4e-3], 3)
    seen = simulated(on_plates(2, (), beads), ways)
    magnified = replace(seen, fiducials=1.03 * seen.fiducials)
    found = diagnosed_at_once([magnified], Catalogue(few, ()), TINY, COARSE_GRADING)
    assert found.verdict == ("camera_scale",)
    unseen = {label for label, effect in found.effects.items() if not effect.detectable}
    assert unseen == {"anchor_debonding", "anchor_compliance"}


def test_a_smooth_platen_sinks_under_a_known_load_as_the_closed_form_says() -> None:
    material, stretch = Material(NeoHookean(), 20e3, 0.42), 0.93
    _, stress = homogeneous(material, 2, stretch, ())
    exact = replace(SENSOR, force_std=1e-9, torque_std=1e-9, position_std=1e-9, orientation_std=1e-9)
    planned = with_two_rows(replace(on_plates(2, ()), rollers=(Roller(face(2, -1), ("z",)),), sensor=exact))
    load = np.full((2, 6), np.nan)
    load[:, 2] = -stress * SIZE[0] * SIZE[1]
    hung = replace(planned, driven="load", wrench=load, first_row="under_load")
    (seen,) = simulate_case([hung], material, 0, resolution=Resolution(TINY, "hex27"))
    assert seen.position[1, 2] - CORNER[2] == pytest.approx((stretch - 1) * SIZE[2], rel=1e-5)


@pytest.fixture(scope="module")
def cylinder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Experiment]:
    """A cylinder of a triangulated surface between smooth platens, and nothing else that holds it."""
    folder = tmp_path_factory.mktemp("cylinder")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RETRACT_CACHE", str(folder))
        file = folder / "cylinder.stl"
        write_stl(cylinder_surface(0.03, 0.02, 12), file)
        x, y, z = np.ptp(surface_bounds(file, "m"), axis=0).tolist()
        low, high = Box((-1, -1, -0.01), (1, 1, -0.01)), Box((-1, -1, 0.01), (1, 1, 0.01))
        rest = block_at_rest((x, y, z), high, SENSOR, np.zeros((0, 3)))
        yield replace(
            rest,
            phantom=Phantom("surface", (x, y, z), file, unit="m"),
            anchors=(),
            rollers=(Roller(low, ("z",)),),
            grasp=Grasp(high, (0.0, 0.0, 0.01), ("z",)),
        )


def test_a_cylinder_between_smooth_platens_is_in_the_uniaxial_state(cylinder: Experiment) -> None:
    check_experiment(with_two_rows(cylinder))
    material, stretch = Material(NeoHookean(), 20e3, 0.45), 0.85
    # Larger elements may leave the side so far, and in no two runs alike, that it is no cylinder within the tolerance.
    problem = mesh_experiment(cylinder, Grading(10e-3, 10e-3, 10e-3, 3.0, 1))
    pose = GripperPose(np.array([0.0, 0.0, 0.01 - (1 - stretch) * 0.02]), Rotation.identity())
    (state,) = follow(problem, material, [pose])
    stretches, stress = homogeneous(material, 2, stretch, ())
    area = float(problem.body.volume.sum()) / 0.02
    assert observe(problem, state).wrench[2] == pytest.approx(-stress * area, rel=1e-4)
    middle = (problem.body.mesh.points + state.displacement).mean(axis=0) - problem.body.mesh.points.mean(
        axis=0
    )
    # The node that is pinned lies within an element of the middle, and moves by a tenth of that.
    assert np.abs(middle[:2]).max() < 5e-4
    assert np.ptp((problem.body.mesh.points + state.displacement)[:, 0]) == pytest.approx(
        stretches[0] * np.ptp(problem.body.mesh.points[:, 0]), rel=1e-4
    )


def test_a_roller_that_reaches_into_a_surface_is_refused(cylinder: Experiment) -> None:
    deep = Roller(Box((-1, -1, -0.011), (1, 1, -0.005)), ("z",))
    with pytest.raises(
        InputError, match="roller 1 holds some directions only, and its box reaches into the tissue"
    ):
        mesh_experiment(replace(cylinder, rollers=(deep,)), Grading(20e-3, 20e-3, 40e-3, 3.0, 1))
