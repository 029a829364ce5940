"""Tissue that slides on the plates between which it is pressed, as far as Coulomb's friction lets it."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
from at_once import diagnosed_at_once
from bare_contexts import bare_context
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK, block_at_rest, follow, straight_pull, with_rows
from scipy.spatial.transform import Rotation

from estimator.diagnosis.fitting.case import Case
from estimator.diagnosis.model.free_parameters import HypothesisParameter, free_parameters
from estimator.diagnosis.model.grip_load import GripLoad
from estimator.diagnosis.model.hypothesis import Hypothesis
from estimator.diagnosis.model.setup import Setup
from estimator.diagnosis.model.solution import mechanics_of, solve_case
from estimator.diagnosis.search.screening import can_show
from estimator.diagnosis.sensitivity.perturbation import Perturbation
from estimator.diagnosis.sensitivity.readings import channels, derivatives, predicted_readings
from estimator.diagnosis.settings import DiagnosisSettings, SolverSettings
from estimator.effects.catalogue import Catalogue, default_catalogue
from estimator.effects.effect import Effect
from estimator.effects.mounting.platen_friction import PLATEN_FRICTION
from estimator.experiment import Box, Experiment, Grasp, Phantom, Roller, SensorNoise
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import HeldNodes, RetractionProblem, retraction_problem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.equilibrium.newton import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium.observation import Observation, observe
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.forward.meshing import mesh_experiment
from estimator.importing.bodies import cylinder_surface
from estimator.materials import NeoHookean
from estimator.materials.material import Material
from estimator.simulation.acting import read_effect
from estimator.simulation.simulate import Resolution, simulate_case
from estimator.surfaces.writing import write_stl

FloatArray = NDArray[np.float64]

SIZE = (0.02, 0.03, 0.03)
CORNER = np.array(SIZE) / 2
TOP = Box((CORNER[0], -CORNER[1], -CORNER[2]), (CORNER[0], CORNER[1], CORNER[2]))
SENSOR = SensorNoise(force_std=0.02, torque_std=5e-4, fiducial_std=5e-5, position_std=1e-5)
# On the sides that bulge, and within.
BEADS = 1e-3 * np.array(
    [(x, *side) for x in (-6.0, 0.0, 5.0) for side in ((15, 4), (-15, -6), (3, 15), (-5, -15))]
)
SPECIMEN = block_at_rest(SIZE, TOP, SENSOR, BEADS)
CENTRE = np.array(SPECIMEN.grasp.centre)
GRADING = Grading(4e-3, 8e-3, 8e-3, 2.0, 3)
TISSUE = Material(NeoHookean(), 75e3, 0.47)
BOTH, MOVING, STANDING = PLATEN_FRICTION
EXACT = NewtonSettings(tolerance=1e-12)


@pytest.fixture(scope="module")
def bonded() -> RetractionProblem:
    return mesh_experiment(SPECIMEN, GRADING)


def pressed(way_m: float, aside_m: float = 0.0) -> GripperPose:
    return GripperPose(CENTRE + np.array([-way_m, aside_m, 0.0]), Rotation.identity())


def rubbing(
    bonded: RetractionProblem,
    poses: Sequence[GripperPose],
    slipperiness: float,
    effect: Effect = BOTH,
    material: Material = TISSUE,
) -> tuple[RetractionProblem, EquilibriumState]:
    """The state at the last of the poses, of a material there; sticking points are dragged along on the way."""
    values = {"slipperiness": slipperiness, "give": 1e-3}
    problem = effect.problem(bonded, values)
    terms = effect.terms(problem, TISSUE, SPECIMEN, values)
    solver = EquilibriumSolver(problem, EXACT)
    state = solver.rest(TISSUE, terms)
    for pose in poses:
        state = solver.solve(pose, material if pose is poses[-1] else TISSUE, state, terms)
        terms = tuple(
            term.carried_to(pose.position, pose.rotation).after(state.displacement, state.response)
            for term in terms
        )
    return problem, state


def felt(bonded: RetractionProblem, poses: Sequence[GripperPose], slipperiness: float) -> FloatArray:
    return observe(*rubbing(bonded, poses, slipperiness)).wrench


def test_without_slipperiness_the_faces_are_bonded(bonded: RetractionProblem) -> None:
    absent = {"slipperiness": 0.0, "give": 1e-3}
    for effect in PLATEN_FRICTION:
        assert effect.problem(bonded, absent) is bonded
        assert effect.terms(bonded, TISSUE, SPECIMEN, absent) == ()
    (glued,) = follow(bonded, TISSUE, [pressed(2e-3)], EXACT)
    _, held = rubbing(bonded, [pressed(2e-3)], 1e-9)
    np.testing.assert_allclose(held.displacement, glued.displacement, atol=1e-11)


def test_the_softer_the_hold_the_smaller_the_force_down_to_that_between_rollers(
    bonded: RetractionProblem,
) -> None:
    smooth = replace(
        SPECIMEN,
        anchors=(),
        rollers=(Roller(Box(tuple(-CORNER), (-CORNER[0], CORNER[1], CORNER[2])), ("x",)),),
        grasp=replace(SPECIMEN.grasp, directions=("x",)),
    )
    rolling = mesh_experiment(smooth, GRADING)
    (free,) = follow(rolling, TISSUE, [pressed(2e-3)], EXACT)
    least = observe(rolling, free).wrench[0]
    forces = [felt(bonded, [pressed(2e-3)], size)[0] for size in (0.0, 1.0, 4.0, 20.0, 1e6)]
    assert np.all(np.diff(forces) < 0)
    assert forces[-1] == pytest.approx(least, rel=1e-5)


DIAMETER, HEIGHT = 0.03, 0.02


@pytest.fixture(scope="module")
def cylinder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Experiment]:
    """A cylinder of a triangulated surface that stands on one plate, below another one."""
    folder = tmp_path_factory.mktemp("cylinder")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RETRACT_CACHE", str(folder))
        file, end = folder / "cylinder.stl", HEIGHT / 2
        write_stl(cylinder_surface(DIAMETER, HEIGHT, 24), file)
        low, high = Box((-1, -1, -end), (1, 1, -end)), Box((-1, -1, end), (1, 1, end))
        rest = block_at_rest((DIAMETER, DIAMETER, HEIGHT), high, SENSOR, np.zeros((0, 3)))
        phantom = Phantom("surface", (DIAMETER, DIAMETER, HEIGHT), file, unit="m")
        yield replace(rest, phantom=phantom, anchors=(low,), grasp=Grasp(high, (0.0, 0.0, end)))


def test_a_cylinder_on_smooth_plates_is_as_between_rollers_and_a_little_friction_does_what_siebel_says(
    cylinder: Experiment,
) -> None:
    """E. Siebel, Stahl und Eisen 43 (1923) 1295: by μ D/(3 H) λ^(−3/2), where all of both faces slides."""
    plates = mesh_experiment(cylinder, Grading(10e-3, 10e-3, 10e-3, 3.0, 1))
    upwards = np.array([False, False, True])
    held = HeldNodes(np.zeros_like(plates.fixed), plates.gripped, np.outer(plates.anchored, upwards), upwards)
    nowhere = np.zeros((0, 3)), np.zeros(0, dtype=bool)
    rolling = retraction_problem(plates.body.mesh, held, plates.grasp_centre, *nowhere)
    stretch = 0.9
    down = np.array([0.0, 0.0, HEIGHT * (stretch - 0.5)])
    pose = GripperPose(down, Rotation.identity())
    (free,) = follow(rolling, TISSUE, [pose], EXACT)
    least = observe(rolling, free).wrench[2]
    forces = [observe(*rubbing(plates, [pose], size)).wrench[2] for size in (1e6, 40.0)]
    assert forces[0] == pytest.approx(least, rel=1e-5)
    siebel = DIAMETER / (40.0 * 3 * HEIGHT) * stretch**-1.5
    assert forces[1] / forces[0] - 1 == pytest.approx(siebel, rel=0.1)


@pytest.mark.parametrize("effect", [MOVING, STANDING], ids=lambda effect: effect.name)
def test_what_is_dragged_aside_slides_at_coulomb_s_limit(bonded: RetractionProblem, effect: Effect) -> None:
    """Whichever of the faces it is that slides."""
    way = [pressed(2e-3), pressed(2e-3, 6e-3), pressed(2e-3, 9e-3)]
    wrench = observe(*rubbing(bonded, way, 10.0, effect)).wrench
    assert wrench[1] == pytest.approx(-0.1 * wrench[0], rel=0.01)


def test_what_has_slid_stays_where_it_is_until_it_is_pushed_back(bonded: RetractionProblem) -> None:
    back = pressed(2e-3)
    lost = [
        1.0 - felt(bonded, [back, pressed(3e-3), back], size)[0] / felt(bonded, [back], size)[0]
        for size in (1e-9, 4.0)
    ]
    assert abs(lost[0]) < 1e-9 < 0.01 < lost[1]


def turned(shift: FloatArray) -> GripperPose:
    """Off a pose at which nothing is symmetric, by (6,)."""
    turn = Rotation.from_rotvec(shift[3:]) * Rotation.from_rotvec([0.02, 0.004, 0.006])
    return GripperPose(CENTRE + np.array([-2e-3, 5e-4, -2e-4]) + shift[:3], turn)


def seen(
    bonded: RetractionProblem, effect: Effect, shift: FloatArray, poisson_ratio: float = 0.47
) -> Observation:
    way = CENTRE + np.array([-1e-3, 3e-4, 0.0])
    before = GripperPose(way, Rotation.from_rotvec([0.01, 0.0, 0.003]))
    material = Material(NeoHookean(), 75e3, poisson_ratio)
    return observe(*rubbing(bonded, [before, turned(shift)], 4.0, effect, material))


def of(one: Observation) -> FloatArray:
    return np.concatenate([one.wrench, one.fiducials.ravel()])


@pytest.mark.parametrize("effect", PLATEN_FRICTION, ids=lambda effect: effect.name)
def test_what_is_seen_of_sliding_tissue_has_the_derivatives_of_solved_states(
    bonded: RetractionProblem, effect: Effect
) -> None:
    here = seen(bonded, effect, np.zeros(6))
    by_pose = np.concatenate([here.wrench_by_pose, here.fiducials_by_pose.reshape(-1, 6)])
    by_ratio = np.concatenate([here.wrench_by["poisson_ratio"], here.fiducials_by["poisson_ratio"].ravel()])
    steps = 1e-6 * np.eye(6)
    quotients = [(of(seen(bonded, effect, step)) - of(seen(bonded, effect, -step))) / 2e-6 for step in steps]
    there, back = (of(seen(bonded, effect, np.zeros(6), 0.47 + change)) for change in (1e-5, -1e-5))
    for kind in (slice(0, 3), slice(3, 6), slice(6, None)):
        for known, quotient in (
            (by_pose.T, np.array(quotients)),
            (by_ratio[None], (there - back)[None] / 2e-5),
        ):
            largest = np.abs(quotient[:, kind]).max()
            np.testing.assert_allclose(known[:, kind], quotient[:, kind], atol=1e-5 * largest)


def planned(ways_m: Sequence[float]) -> Experiment:
    """The plate goes along its normal, a little aside and askew."""
    turns = [Rotation.from_rotvec([0.0, 5 * way, 2 * way]) for way in ways_m]
    poses = [
        GripperPose(CENTRE + way * np.array([-1.0, 0.15, 0.05]), turn)
        for way, turn in zip(ways_m, turns, strict=True)
    ]
    rows = len(poses)
    return with_rows(SPECIMEN, poses, np.zeros((rows, 6)), np.zeros((rows, *BEADS.shape)))


WAYS = (0.0, 5e-4, 1.2e-3, 2e-3, 3e-3, 2.2e-3, 1e-3)


@pytest.mark.parametrize("effect", PLATEN_FRICTION, ids=lambda effect: effect.name)
@pytest.mark.parametrize("slipperiness", [0.0, 3.0])
def test_a_little_more_slipperiness_does_what_its_derivative_says(
    bonded: RetractionProblem, effect: Effect, slipperiness: float
) -> None:
    """Also at the null, where the solved states hold what a little of it lets slide, and what has slid is kept."""
    exact = DiagnosisSettings(solver=SolverSettings(tangent_reuse=0.0, tolerance=1e-10))
    setup = Setup([planned(WAYS)], bonded, [GripLoad.none(len(WAYS))], settings=exact)
    zero = np.zeros((len(WAYS), 6 + BEADS.size))
    alone = Hypothesis(75e3, 0.47)

    def readings(hypothesis: Hypothesis) -> FloatArray:
        (one,) = solve_case(setup, hypothesis)
        return channels(predicted_readings(mechanics_of(one), hypothesis, zero))

    here = alone.with_effect(effect, {"slipperiness": slipperiness, "give": 1e-3})
    free = next(one for one in free_parameters(here) if one.key == "slipperiness")
    solved = [mechanics_of(one) for one in solve_case(setup, here if slipperiness else alone)]
    (found,) = derivatives(solved, here, [perturbation(here, free, effect)], [zero])
    step = 1e-3
    quotient = (readings(free.put(here, slipperiness + step)) - readings(here)) / step
    for kind in (slice(0, 3), slice(3, 6), slice(6, None)):
        off = np.linalg.norm(found[:, kind, 0] - quotient[:, kind])
        assert off < 0.01 * np.linalg.norm(quotient[:, kind])


def perturbation(here: Hypothesis, free: HypothesisParameter, effect: Effect) -> Perturbation:
    return Perturbation(free.name, free.put(here, free.of(here).internal + free.step), effect, free.step)


def looked_for(experiment: Experiment) -> set[str]:
    """Labels that a diagnosis of an experiment could tell."""
    context = bare_context(case=Case((experiment,), mesh_experiment(experiment, GRADING), (), (), ()))
    return {effect.label for effect in default_catalogue().effects if can_show(effect, context)}


def test_friction_is_looked_for_only_where_a_body_is_pressed_between_two_plates() -> None:
    pressing = planned((0.0, 1e-3))
    drawing = planned((0.0, -1e-3))
    block = with_rows(
        REFERENCE_BLOCK,
        straight_pull(REFERENCE_BLOCK, -1e-3, 2),
        np.zeros((2, 6)),
        np.zeros((2, *REFERENCE_BLOCK.fiducials_rest.shape)),
    )
    assert "platen_friction" in looked_for(pressing)
    assert "platen_friction" not in looked_for(drawing) | looked_for(block)
    assert looked_for(pressing) - {"platen_friction"} == looked_for(drawing)


def test_friction_in_a_compression_is_found_and_the_modulus_with_it() -> None:
    everything = default_catalogue()
    labels = ("platen_friction", "anchor_compliance", "force_axis_gain", "camera_scale", "prestretch")
    few = tuple(one for one in everything.effects if one.label in labels and not one.elaborates)
    ways = (0.0, 5e-4, 1e-3, 1.6e-3, 2.2e-3, 3e-3, 2e-3, 1e-3)
    straight = with_rows(
        SPECIMEN, [pressed(way) for way in ways], np.zeros((8, 6)), np.zeros((8, *BEADS.shape))
    )
    finer = Resolution(Grading(2e-3, 5e-3, 5e-3, 2.0, 5), "hex27")
    acting = [read_effect("platen_friction=4")]
    found = diagnosed_at_once(
        simulate_case([straight], TISSUE, 3, acting, resolution=finer),
        Catalogue(few, ()),
        GRADING,
        Grading(3e-3, 6e-3, 6e-3, 2.0, 4),
    )
    assert found.verdict == ("platen_friction",)
    size = found.effects["platen_friction"].parameters["slipperiness"]
    assert abs(size.value - 4.0) < 2.0 * size.std < 2.0
    assert found.after.youngs_modulus.value == pytest.approx(75e3, rel=0.03)
