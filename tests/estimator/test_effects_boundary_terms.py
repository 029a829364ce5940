"""Forces on the tissue's boundary: yielding anchors, friction on the table, the tissue's weight."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from retraction_cases import REFERENCE_BLOCK, SMALL_BLOCK, straight_pull
from scipy.spatial.transform import Rotation

from estimator.effects.effect import Effect, Values
from estimator.effects.mounting.anchor_compliance import ANCHOR_COMPLIANCE
from estimator.effects.mounting.anchor_debonding import ANCHOR_DEBONDING
from estimator.effects.mounting.gravity_sag import GRAVITY_SAG
from estimator.effects.mounting.support_friction import SUPPORT_FRICTION
from estimator.effects.shared.on_table import area_on_table
from estimator.errors import InputError
from estimator.experiment import Box, Experiment
from estimator.fem.assembly.body import respond
from estimator.fem.boundary.anchorage import anchored_areas, rim_of
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading, structured_mesh
from estimator.fem.discretisation.shares import nodal_areas, nodal_volumes
from estimator.fem.discretisation.surface import boundary_faces
from estimator.fem.equilibrium.newton import EquilibriumSolver, NewtonSettings
from estimator.fem.equilibrium.observation import observe
from estimator.fem.equilibrium.state import EquilibriumState
from estimator.fem.terms.friction import LaidDownAnew, LyingOnTable
from estimator.fem.terms.term import Term
from estimator.forward.meshing import mesh_experiment
from estimator.materials import NeoHookean
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

TINY = Grading(grasp_m=3e-3, anchor_m=8e-3, largest_m=25e-3, growth=3, layers=1)
BLOCK = mesh_experiment(REFERENCE_BLOCK, TINY)
# Also along y = 0.05.
TWO_SIDES = replace(
    REFERENCE_BLOCK,
    anchors=(*REFERENCE_BLOCK.anchors, Box((-0.0501, 0.0499, -0.0051), (0.0501, 0.0501, 0.0051))),
)
# Gripped over its whole end face: a bar.
BAR = mesh_experiment(SMALL_BLOCK, TINY)
MATERIAL = Material(NeoHookean(), 15e3, 0.45)
STAY = GripperPose(BLOCK.grasp_centre, Rotation.identity())
ELASTIC_SLIP = 2e-4
TABLE = {"adhesion": 40.0, "elastic_slip": ELASTIC_SLIP}


def follow_under(
    effect: Effect,
    values: Values,
    poses: Sequence[GripperPose],
    problem: RetractionProblem = BLOCK,
    material: Material = MATERIAL,
) -> list[EquilibriumState]:
    changed = effect.problem(problem, values)
    terms = effect.terms(changed, material, REFERENCE_BLOCK, values)
    solver = EquilibriumSolver(changed, NewtonSettings(iterations=80))
    states = [solver.rest(material)]
    for pose in poses:
        states.append(solver.solve(pose, material, states[-1], terms))
        terms = tuple(term.after(states[-1].displacement, states[-1].response) for term in terms)
    return states[1:]


def pull_force(effect: Effect, values: Values, length_m: float = 2e-3) -> float:
    changed = effect.problem(BLOCK, values)
    state = follow_under(effect, values, straight_pull(REFERENCE_BLOCK, length_m, 1))[0]
    return -float(observe(changed, state).wrench[0])


def random_field(problem: RetractionProblem) -> FloatArray:
    return 5e-4 * np.random.default_rng(7).normal(size=problem.body.mesh.points.shape)


TERMS = [
    (ANCHOR_COMPLIANCE[0], {"length": 8e-3}),
    (ANCHOR_COMPLIANCE[1], {"normal_length": 8e-3, "tangential_length": 0.0, "unevenness": 0.0}),
    (ANCHOR_COMPLIANCE[1], {"normal_length": 8e-3, "tangential_length": 4e-3, "unevenness": 0.6}),
    (ANCHOR_DEBONDING, {"share": 0.3, "place": 0.4}),
    (GRAVITY_SAG[0], {"weight": 1.0}),
    (SUPPORT_FRICTION[0], {"coefficient": 0.6, "contact": 0.8, **TABLE}),
    (
        SUPPORT_FRICTION[2],
        {"coefficient": 0.6, "contact": 0.8, **TABLE, "unevenness_x": 0.5, "unevenness_y": -0.3},
    ),
]


@pytest.mark.parametrize(("effect", "values"), TERMS, ids=lambda v: getattr(v, "name", ""))
def test_the_stiffness_of_a_term_is_the_derivative_of_its_forces(effect: Effect, values: Values) -> None:
    problem = effect.problem(BLOCK, values)
    (term,) = effect.terms(problem, MATERIAL, REFERENCE_BLOCK, values)
    field, direction = random_field(problem), random_field(problem)[::-1]
    response = respond(problem.body, MATERIAL, np.zeros_like(field))
    term = term.after(0.3 * direction, response)
    step = 1e-5
    ahead, behind = (term.forces(field + s * direction, response) for s in (step, -step))
    nodes = term.stiffness(field, response).nodes
    expected = np.zeros_like(field) if nodes is None else np.einsum("nij,nj->ni", nodes, direction)
    scale = max(float(np.abs(expected).max()), float(np.abs(term.forces(field, response)).max()))
    np.testing.assert_allclose((ahead - behind) / (2 * step), expected, atol=1e-6 * scale)


@pytest.mark.parametrize("kind", ["hex8", "hex27", "hex64"])
def test_the_nodes_share_volume_and_surface_without_loss(kind: str) -> None:
    problem = mesh_experiment(REFERENCE_BLOCK, TINY, kind)  # type: ignore[arg-type]  # parametrised
    grasp = 0.02 * 0.02 * 0.01
    assert nodal_volumes(problem.body.mesh).sum() == pytest.approx(1e-4 - grasp)
    area, normals = anchored_areas(problem)
    assert area.sum() == pytest.approx(0.1 * 0.01)
    np.testing.assert_allclose(normals.sum(axis=0), np.diag([1e-3, 0.0, 0.0]), atol=1e-15)
    assert not area[~problem.fixed].any()
    assert area_on_table(problem).sum() == pytest.approx(0.01 - 0.02 * 0.02)
    mesh = structured_mesh(
        [np.array([0.0, 1.0]), np.array([0.0, 2.0]), np.array([0.0, 3.0])], problem.body.mesh.kind
    )
    assert nodal_areas(mesh, boundary_faces(mesh))[0].sum() == pytest.approx(22.0)


def test_two_anchored_sides_meet_in_a_corner_that_belongs_to_both() -> None:
    area, normals = anchored_areas(mesh_experiment(TWO_SIDES, TINY))
    assert area.sum() == pytest.approx(2e-3)
    np.testing.assert_allclose(normals.sum(axis=0), np.diag([1e-3, 1e-3, 0.0]), atol=1e-15)


def test_a_soft_anchor_lengthens_a_bar_by_its_equivalent_length() -> None:
    """A bar free to contract, ν = 0: springs and tissue in series, E A u / (L + equivalent length)."""
    bar, material = BAR, Material(NeoHookean(), 15e3, 0.0)
    pull = [GripperPose(bar.grasp_centre + np.array([1e-6, 0.0, 0.0]), Rotation.identity())]
    for length in (0.0, 1e-3, 12e-3):
        values = {"length": length}
        state = follow_under(ANCHOR_COMPLIANCE[0], values, pull, bar, material)[0]
        force = -observe(ANCHOR_COMPLIANCE[0].problem(bar, values), state).wrench[0]
        assert force == pytest.approx(15e3 * 0.03 * 0.01 * 1e-6 / (0.048 + length), rel=1e-4)


def test_a_nearly_rigid_anchor_is_the_rigid_one_to_first_order() -> None:
    rigid = pull_force(ANCHOR_COMPLIANCE[0], {"length": 0.0})
    softer = [rigid - pull_force(ANCHOR_COMPLIANCE[0], {"length": length}) for length in (1e-5, 2e-5)]
    assert 0.0 < softer[0] < 1e-3 * rigid
    assert softer[1] == pytest.approx(2 * softer[0], rel=0.01)


def test_an_anchor_soft_along_its_face_alone_gives_less_than_one_soft_all_round() -> None:
    def force(normal: float, tangential: float) -> float:
        effect = ANCHOR_COMPLIANCE[1]
        lengths = {"normal_length": normal, "tangential_length": tangential}
        return pull_force(effect, {**lengths, "unevenness": 0.0})

    rigid, isotropic = (pull_force(ANCHOR_COMPLIANCE[0], {"length": length}) for length in (0.0, 8e-3))
    assert force(8e-3, 8e-3) == pytest.approx(isotropic, rel=1e-9)
    assert isotropic < force(8e-3, 0.0) < force(0.0, 8e-3) < rigid


def test_an_uneven_anchor_gives_more_at_its_soft_end() -> None:
    lengths = {"normal_length": 8e-3, "tangential_length": 8e-3}
    pull = straight_pull(REFERENCE_BLOCK, 2e-3, 1)
    even, uneven = (
        follow_under(ANCHOR_COMPLIANCE[1], {**lengths, "unevenness": k}, pull)[0].displacement[:, 0]
        for k in (0.0, 0.8)
    )
    y = BLOCK.body.mesh.points[:, 1]
    ends = [BLOCK.anchored & (side * y > 0.04) for side in (1.0, -1.0)]
    # The rim runs anticlockwise, from the end at +y to that at -y.
    assert uneven[ends[0]].mean() < even[ends[0]].mean()
    assert uneven[ends[1]].mean() > even[ends[1]].mean()


def test_two_uneven_anchors_give_more_each_at_its_own_soft_end() -> None:
    block = mesh_experiment(TWO_SIDES, TINY)
    effect = ANCHOR_COMPLIANCE[2]
    lengths = {"normal_length": 8e-3, "tangential_length": 8e-3}

    def stiffness(first: float, second: float) -> FloatArray:
        values = {**lengths, "unevenness_1": first, "unevenness_2": second}
        (term,) = effect.terms(effect.problem(block, values), MATERIAL, TWO_SIDES, values)
        nothing = np.zeros_like(block.body.mesh.points)
        nodes = term.stiffness(nothing, respond(block.body, MATERIAL, nothing)).nodes
        assert nodes is not None
        return np.trace(nodes, axis1=1, axis2=2)

    even = stiffness(0.0, 0.0)
    factor = stiffness(0.6, -0.4) / np.where(even > 0.0, even, 1.0)
    x, y, _ = block.body.mesh.points.T
    # Anticlockwise the second anchor comes first, from +x on, and the first one after the corner, from +y on.
    expected = {(0.05, 0.05): 0.6, (-0.05, 0.05): (1.4 + 1.6) / 2, (-0.05, -0.05): 0.4}
    for (at_x, at_y), value in expected.items():
        corner = np.isclose(x, at_x) & np.isclose(y, at_y)
        np.testing.assert_allclose(factor[corner], value, rtol=1e-9)


def test_one_anchor_cannot_be_two_uneven_ones() -> None:
    values = {"normal_length": 8e-3, "tangential_length": 8e-3, "unevenness_1": 0.4, "unevenness_2": 0.4}
    with pytest.raises(
        InputError, match="for two anchors and the phantom has 1; take anchor_compliance:uneven"
    ):
        pull_force(ANCHOR_COMPLIANCE[2], values)


def test_a_debonded_share_of_the_rim_is_lost_at_its_place() -> None:
    area, _ = anchored_areas(BLOCK)
    y = BLOCK.body.mesh.points[:, 1]
    for place, lost_middle in ((0.0, 0.04), (0.5, 0.0), (1.0, -0.04)):
        stays = rim_of(BLOCK).attached(0.2, place)
        lost = area * (1.0 - stays)
        assert lost.sum() == pytest.approx(0.2 * area.sum())
        assert (lost @ y) / lost.sum() == pytest.approx(lost_middle, abs=4e-3)
        assert np.all((stays >= 0.0) & (stays <= 1.0))


def test_debonding_runs_round_the_corner_of_two_sides() -> None:
    problem = mesh_experiment(TWO_SIDES, TINY)
    area, _ = anchored_areas(problem)
    lost = area * (1.0 - rim_of(problem).attached(0.3, 0.5))
    middle = (lost @ problem.body.mesh.points) / lost.sum()
    np.testing.assert_allclose(middle[:2], [-0.05, 0.05], atol=0.015)


@pytest.mark.parametrize("experiment", [REFERENCE_BLOCK, TWO_SIDES], ids=["one side", "two sides"])
def test_a_search_looks_over_stretches_of_any_length_at_any_place_of_the_rim(experiment: Experiment) -> None:
    rim = rim_of(mesh_experiment(experiment, TINY))
    kept = np.array([rim.attached(each["share"], each["place"]) for each in ANCHOR_DEBONDING.looked_over()])
    lost = 1.0 - kept @ rim.area / rim.area.sum()
    assert 0.02 < lost.min() < 0.1
    assert lost.max() > 0.8
    # Every anchored node comes off in some, and stays in others.
    assert np.all(kept.min(axis=0)[rim.anchored] == 0.0)
    assert np.all(kept.max(axis=0) == 1.0)


def test_a_table_that_holds_one_side_alone_drags_that_side_alone() -> None:
    even = {"coefficient": 0.6, "contact": 0.0, **TABLE}
    plain, uneven = SUPPORT_FRICTION[0], SUPPORT_FRICTION[2]
    field = np.tile([1e-4, 0.0, 0.0], (len(BLOCK.body.mesh.points), 1))
    response = respond(BLOCK.body, MATERIAL, np.zeros_like(field))

    def drag(effect: Effect, **more: float) -> FloatArray:
        (term,) = effect.terms(BLOCK, MATERIAL, REFERENCE_BLOCK, {**even, **more})
        return term.forces(field, response)[:, 0]

    x = BLOCK.body.mesh.points[:, 0]
    alike, tilted = drag(plain), drag(uneven, unevenness_x=1.0, unevenness_y=0.0)
    np.testing.assert_allclose(drag(uneven, unevenness_x=0.0, unevenness_y=0.0), alike)
    np.testing.assert_allclose(tilted, alike * (1.0 + x / 0.05), atol=1e-15)


def test_the_force_falls_steadily_and_without_jumps_as_the_anchor_comes_off() -> None:
    shares = np.linspace(0.0, 0.3, 13)
    force = np.array([pull_force(ANCHOR_DEBONDING, {"share": s, "place": 0.0}) for s in shares])
    steps = -np.diff(force) / force[0]
    assert np.all(steps > 0.0)
    assert steps.max() < 0.02
    assert force[0] - pull_force(ANCHOR_DEBONDING, {"share": 1e-6, "place": 0.0}) < 1e-5 * force[0]


def test_the_gripper_and_the_anchors_carry_the_hanging_weight() -> None:
    values = {"weight": 1.0}
    (state,) = follow_under(GRAVITY_SAG[0], values, [STAY])
    weight = 1070 * 9.81 * (1e-4 - 0.02 * 0.02 * 0.01)
    (term,) = GRAVITY_SAG[0].terms(BLOCK, MATERIAL, REFERENCE_BLOCK, values)
    load = -term.forces(state.displacement, state.response)
    np.testing.assert_allclose(load.sum(axis=0), [0.0, 0.0, -weight], atol=1e-12)
    np.testing.assert_allclose(state.forces.sum(axis=0), [0.0, 0.0, weight], atol=1e-9)
    assert state.displacement[:, 2].min() < -5e-3


def test_beads_that_were_seen_when_the_phantom_hung_sit_on_tissue_that_lies_elsewhere_undeformed() -> None:
    before, after, *_ = GRAVITY_SAG
    weight = {"weight": 0.3}
    (state,) = follow_under(before, weight, [STAY])
    seen = BLOCK.fiducial_positions(state.displacement, STAY)
    stated = mesh_experiment(replace(REFERENCE_BLOCK, fiducials_rest=seen), TINY)
    placed = after.beads(stated, state.displacement, weight)
    sagged = np.linalg.norm(seen - REFERENCE_BLOCK.fiducials_rest, axis=1).max()
    assert sagged > 1e-3
    np.testing.assert_allclose(placed.fiducials_rest, REFERENCE_BLOCK.fiducials_rest, atol=0.02 * sagged)


def node_on_table(
    coefficient: float = 1.0,
    depth_m: float = np.inf,
    adhesion_n: float = 0.0,
    kind: type[LyingOnTable] = LaidDownAnew,
) -> LyingOnTable:
    """A node that weighs 10 mN."""
    return kind.at_rest(np.array([1e-2]), np.array([adhesion_n]), coefficient, ELASTIC_SLIP, depth_m)


def test_a_block_pushed_and_pulled_draws_the_closed_loop_of_an_elastic_plastic_spring() -> None:
    """Out by five elastic slips, back by five: the force turns over within two elastic slips."""
    nothing = respond(BLOCK.body, MATERIAL, np.zeros_like(BLOCK.body.mesh.points))
    way = ELASTIC_SLIP * np.array([0.5, 1.0, 3.0, 5.0, 4.5, 4.0, 3.5, 3.0, 0.0, -1.0, 0.0, 1.0, 5.0])
    expected = [0.5, 1.0, 1.0, 1.0, 0.5, 0.0, -0.5, -1.0, -1.0, -1.0, 0.0, 1.0, 1.0]
    friction: Term = node_on_table()
    direction = np.array([0.6, -0.8, 0.0])
    for place, share in zip(way, expected, strict=True):
        field = place * direction[None]
        force = friction.forces(field, nothing)[0]
        np.testing.assert_allclose(force, 1e-2 * share * direction, atol=1e-12)
        friction = friction.after(field, nothing)
    assert not friction.rested().forces(np.zeros((1, 3)), nothing).any()


def test_a_block_left_lying_still_pulls_in_the_next_experiment() -> None:
    nothing = respond(BLOCK.body, MATERIAL, np.zeros_like(BLOCK.body.mesh.points))
    dragged = 3 * ELASTIC_SLIP * np.array([[1.0, 0.0, 0.0]])
    left_lying = node_on_table(kind=LyingOnTable).after(dragged, nothing).rested()
    np.testing.assert_allclose(left_lying.forces(0 * dragged, nothing)[0], [-1e-2, 0.0, 0.0], atol=1e-15)


def test_friction_never_exceeds_its_limit_and_follows_the_turning_motion() -> None:
    nothing = respond(BLOCK.body, MATERIAL, np.zeros_like(BLOCK.body.mesh.points))
    friction: Term = node_on_table()
    for angle in np.linspace(0.0, np.pi / 2, 200):
        field = 0.02 * np.array([[np.sin(angle), 1.0 - np.cos(angle), 0.0]])
        force = friction.forces(field, nothing)[0]
        assert np.linalg.norm(force) <= 1e-2 * (1 + 1e-12)
        friction = friction.after(field, nothing)
    np.testing.assert_allclose(force, [0.0, 1e-2, 0.0], atol=2e-4)


@pytest.mark.parametrize("depth", [1e-4, 3e-4])
def test_the_table_pushes_a_sinking_node_and_leaves_a_risen_one_to_its_weight(depth: float) -> None:
    nothing = respond(BLOCK.body, MATERIAL, np.zeros_like(BLOCK.body.mesh.points))
    heights = depth * np.array([0.0, 0.5, 1.0, 7.0, -1.0, -5.0])
    expected = 1e-2 * np.array([0.0, -0.5, -1.0, -1.0, 1.0, 5.0])
    for height, push in zip(heights, expected, strict=True):
        field = np.array([[0.0, 0.0, height]])
        np.testing.assert_allclose(-node_on_table(0.0, depth).forces(field, nothing)[0], [0, 0, push])


@pytest.mark.parametrize(("height", "limit"), [(0.0, 7.5e-3), (5.0, 2.5e-3), (-3.0, 22.5e-3)])
def test_the_friction_limit_follows_pressure_and_adhesion(height: float, limit: float) -> None:
    nothing = respond(BLOCK.body, MATERIAL, np.zeros_like(BLOCK.body.mesh.points))
    table: Term = node_on_table(coefficient=0.5, depth_m=ELASTIC_SLIP, adhesion_n=5e-3)
    table = table.after(np.array([[0.0, 0.0, height * ELASTIC_SLIP]]), nothing)
    force = table.forces(np.array([[0.01, 0.0, 0.0]]), nothing)[0]
    assert force[0] == pytest.approx(limit)
    rested = table.rested().forces(np.array([[0.01, 0.0, 0.0]]), nothing)[0]
    np.testing.assert_allclose(rested, [7.5e-3, 0.0, 0.0], atol=1e-15)


def test_a_twisted_phantom_stays_on_the_table() -> None:
    """Free, half of it would dive and half of it rise; what is near the jaws is bent up and down still."""
    turned = [
        GripperPose(BLOCK.grasp_centre, Rotation.from_rotvec([angle, 0.0, 0.0])) for angle in (0.15, 0.3)
    ]
    values = {"coefficient": 0.5, "contact": 1.0, **TABLE}
    (term,) = SUPPORT_FRICTION[0].terms(BLOCK, MATERIAL, REFERENCE_BLOCK, values)
    assert isinstance(term, LyingOnTable)
    below = term.weight > 0.0
    free = follow_under(Effect(), {}, turned)[-1].displacement[below, 2]
    lying = follow_under(SUPPORT_FRICTION[0], values, turned)[-1].displacement[below, 2]
    assert free.min() < -8e-3
    assert free.max() > 8e-3
    assert lying.min() > 0.25 * free.min()
    assert lying.max() < 0.5 * free.max()


def test_a_rubbing_table_takes_what_gripper_and_anchor_do_not_balance() -> None:
    """Held still by none but the friction, the tissue pulled far rubs with its limit at most."""
    values = {"coefficient": 0.5, "contact": 0.0, **TABLE}
    states = follow_under(SUPPORT_FRICTION[0], values, straight_pull(REFERENCE_BLOCK, 0.02, 4))
    (term,) = SUPPORT_FRICTION[0].terms(BLOCK, MATERIAL, REFERENCE_BLOCK, values)
    assert isinstance(term, LyingOnTable)
    clear = term.adhesion.sum() / 40.0
    assert 0.01 - 0.036 * 0.028 - 1e-3 < clear < 0.01 - 0.02 * 0.02
    limit = 0.5 * (1070 * 9.81 * 0.01 + 40.0) * clear
    rubbing = []
    for state in states:
        rubbing.append(float(term.forces(state.displacement, state.response)[:, 0].sum()))
        free = state.forces.reshape(-1)[BLOCK.pattern.free]
        assert np.linalg.norm(free) < 1e-7 * np.linalg.norm(state.forces[BLOCK.gripped])
        term = term.after(state.displacement, state.response)
    assert np.all(np.diff(rubbing) > 0.0)
    assert 0.5 * limit < rubbing[-1] < limit


@pytest.mark.parametrize("contact", [0.0, 1.0])
def test_friction_holds_the_force_up_on_the_way_out_and_down_on_the_way_back(contact: float) -> None:
    values = {"coefficient": 0.5, "contact": contact, **TABLE}
    out = straight_pull(REFERENCE_BLOCK, 0.01, 4)
    poses = [*out, *reversed(out[:-1])]
    plain = [observe(BLOCK, s).wrench[0] for s in follow_under(Effect(), {}, poses)]
    rubbed = [observe(BLOCK, s).wrench[0] for s in follow_under(SUPPORT_FRICTION[0], values, poses)]
    excess = np.array(plain) - rubbed
    assert excess[3] > 0.05
    assert excess[5] < 0.0


@pytest.mark.parametrize("name", ["coefficient", "contact"])
def test_a_little_friction_or_contact_acts_in_proportion(name: str) -> None:
    """So that a first-order search from the baseline sees it."""
    plain = pull_force(Effect(), {})
    null = {"coefficient": 0.0, "contact": 0.0, **TABLE}
    changes = [pull_force(SUPPORT_FRICTION[0], {**null, name: size}) - plain for size in (1e-3, 2e-3)]
    assert abs(changes[0]) > 1e-8
    assert changes[1] == pytest.approx(2 * changes[0], rel=0.02)
