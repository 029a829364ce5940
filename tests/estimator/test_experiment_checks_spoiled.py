"""`retract check`: an experiment that is spoiled in one way is told what."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from checked_experiments import GOOD, both_ways, graded, of_springs
from retraction_cases import SMALL_BLOCK
from scipy.spatial.transform import Rotation
from spoiled_experiments import beads, column, hung, phantom, rest, sensor, stated, with_rows, wrench

from estimator.experiment import Box, Environment, Experiment, Grasp

TURNED = Rotation.from_euler("z", 4, degrees=True)
SPOILED = [
    # units
    ("size in mm", phantom(size_m=(60.0, 30.0, 10.0)), "size", "wrong"),
    ("an edge of nothing", phantom(size_m=(0.06, 0.03, 0.0)), "size", "wrong"),
    (
        "positions in mm",
        lambda good: replace(good, position=1e3 * good.position),
        "units of positions",
        "wrong",
    ),
    (
        "travel in km",
        lambda good: replace(good, position=good.position[:1] + 1e-3 * (good.position - good.position[:1])),
        "units of positions",
        "wrong",
    ),
    ("beads in mm", beads(lambda m: 1e3 * m), "units of beads", "wrong"),
    ("beads in cm", beads(lambda m: 1e2 * m), "units of beads", "wrong"),
    ("beads 20 % too large", beads(lambda m: 1.2 * m), "units of beads", "suspicious"),
    ("rest of beads in mm", rest(lambda m: 1e3 * m), "units of beads", "wrong"),
    (
        "forces in mN",
        lambda good: replace(wrench(lambda w: 1e3 * w)(good), sensor=good.sensor),
        "size of forces",
        "wrong",
    ),
    ("forces in kN", wrench(lambda w: 1e-3 * w), "stated noise", "suspicious"),
    # signs
    ("force turned over", wrench(lambda w: -w), "sign of forces", "wrong"),
    ("fx turned over", wrench(lambda w: column(w, np.s_[:, 0], np.negative)), "sign of forces", "wrong"),
    # energy
    (
        "less force on the way out than back",
        wrench(lambda w: w * np.linspace(0.2, 1.0, len(w))[:, None]),
        "energy",
        "suspicious",
    ),
    ("a force that lags behind", wrench(lambda w: np.roll(w, 4, axis=0)), "energy", "suspicious"),
    (
        "force before motion",
        wrench(lambda w: w + np.array([0.9, 0, 0, 0, 0, 0])),
        "force before motion",
        "suspicious",
    ),
    # columns
    ("fy is fx", wrench(lambda w: column(w, np.s_[:, 1], lambda _: w[:, 0])), "same columns", "wrong"),
    ("fz is minus fx", wrench(lambda w: column(w, np.s_[:, 2], lambda _: -w[:, 0])), "same columns", "wrong"),
    ("fy constant", wrench(lambda w: column(w, np.s_[:, 1], lambda _: 0.0)), "constant column", "suspicious"),
    (
        "a bead constant",
        beads(lambda m: column(m, np.s_[:, 2, 1], lambda c: c[0])),
        "constant column",
        "suspicious",
    ),
    (
        "nothing measured",
        lambda good: replace(
            good, wrench=np.full_like(good.wrench, np.nan), fiducials=np.full_like(good.fiducials, np.nan)
        ),
        "what is measured",
        "wrong",
    ),
    # rows
    ("two rows exchanged", with_rows(lambda n: [*range(n - 2), n - 1, n - 2]), "order of rows", "wrong"),
    ("a row twice", with_rows(lambda n: [*range(6), 5, *range(6, n)]), "order of rows", "wrong"),
    (
        "a row at two times",
        with_rows(lambda n: [*range(6), 5, *range(6, n)], times_too=False),
        "repeated rows",
        "suspicious",
    ),
    # noise
    ("no noise stated", sensor(force_std=0.0), "stated noise", "wrong"),
    ("noise in mm", sensor(fiducial_std=0.05), "stated noise", "wrong"),
    ("noise in mN", sensor(force_std=20.0), "stated noise", "suspicious"),
    ("too little noise stated", sensor(force_std=2e-3), "seen noise", "suspicious"),
    ("too much noise stated", sensor(torque_std=1e-2), "seen noise", "suspicious"),
    # what holds
    (
        "grasp off the body",
        stated(grasp=Grasp(Box((0.1, 0, 0), (0.2, 0.01, 0.01)), SMALL_BLOCK.grasp.centre)),
        "grasp",
        "wrong",
    ),
    (
        "grasp in mm",
        stated(grasp=Grasp(Box((18, -15, -5), (30, 15, 5)), SMALL_BLOCK.grasp.centre)),
        "grasp",
        "wrong",
    ),
    (
        "grasp of all",
        stated(grasp=Grasp(Box((-1, -1, -1), (1, 1, 1)), SMALL_BLOCK.grasp.centre), anchors=()),
        "grasp",
        "wrong",
    ),
    ("no anchor", stated(anchors=()), "anchors", "wrong"),
    ("anchor off the body", stated(anchors=(Box((-1, -1, -1), (-0.5, 1, 1)),)), "anchors", "wrong"),
    ("anchor in the grasp", stated(anchors=(Box((0.02, -1, -1), (1, 1, 1)),)), "anchors", "wrong"),
    ("another centre", stated(grasp=Grasp(SMALL_BLOCK.grasp.box, (0.0, 0.0, 0.0))), "start", "wrong"),
    (
        "scalar last",
        lambda good: replace(good, quaternion_wxyz=np.roll(good.quaternion_wxyz, -1, axis=1)),
        "start",
        "wrong",
    ),
    (
        "a quaternion of norm 2",
        lambda good: replace(good, quaternion_wxyz=2 * good.quaternion_wxyz),
        "start",
        "wrong",
    ),
    # beads
    (
        "a bead off the body",
        rest(lambda m: column(m, 4, lambda p: p + np.array([0, 0, 0.02]))),
        "places of beads",
        "wrong",
    ),
    (
        "a bead in the body",
        rest(lambda m: column(m, 4, lambda p: p - np.array([0, 0, 0.005]))),
        "places of beads",
        "suspicious",
    ),
    ("two beads in one place", rest(lambda m: column(m, 4, lambda _: m[3])), "places of beads", "wrong"),
    ("beads exchanged", beads(lambda m: m[:, [0, 2, 1, *range(3, 9)]]), "beads at rest", "wrong"),
    (
        "beads mirrored",
        beads(lambda m: m * np.array([1, -1, 1]) + np.array([0, 0, 0])),
        "beads at rest",
        "wrong",
    ),
    ("beads displaced", beads(lambda m: m + np.array([0, 3e-3, 0])), "beads at rest", "suspicious"),
    (
        "beads turned",
        beads(lambda m: TURNED.apply(m.reshape(-1, 3)).reshape(m.shape)),
        "beads at rest",
        "suspicious",
    ),
    (
        "one bead off",
        beads(lambda m: column(m, np.s_[:, 4, 0], lambda x: x + 2e-3)),
        "beads at rest",
        "suspicious",
    ),
    ("beads against the gripper", beads(lambda m: m[:1] - (m - m[:1])), "direction of beads", "suspicious"),
    (
        "an anchored bead that moves",
        stated(anchors=(Box((-0.03, -0.02, -0.01), (-0.01, 0.02, 0.01)),)),
        "held beads",
        "suspicious",
    ),
    # surroundings
    ("gravity in mm/s2", stated(environment=Environment(gravity=(0.0, 0.0, -9810.0))), "gravity", "wrong"),
    (
        "gravity of the Moon",
        stated(environment=Environment(gravity=(0.0, 0.0, -1.62))),
        "gravity",
        "suspicious",
    ),
    (
        "heavy, and nothing below",
        lambda e: replace(
            e,
            environment=Environment(surface_below="none"),
            phantom=replace(e.phantom, density=1200.0),
            wrench=0.1 * e.wrench,
        ),
        "weight",
        "suspicious",
    ),
    (
        "weight that is not felt",
        lambda e: replace(
            e,
            environment=Environment(surface_below="none", weight="acts"),
            sensor=replace(e.sensor, force_zero="no_load", force_std=1e-3),
            wrench=np.where(np.arange(len(e.time))[:, None] == 0, 0.0, e.wrench),
        ),
        "weight",
        "suspicious",
    ),
    ("loads that were hung", hung, "given loads", "suspicious"),
    ("density in g/cm3", phantom(density=1.07), "density", "wrong"),
    ("density of steel", phantom(density=7800.0), "density", "suspicious"),
]


@pytest.mark.parametrize(
    ("spoil", "check", "grade"), [pytest.param(*rest, id=name) for name, *rest in SPOILED]
)
def test_an_experiment_spoiled_in_one_way_is_told_what(
    spoil: Callable[[Experiment], Experiment], check: str, grade: str
) -> None:
    found = graded(spoil(GOOD))
    assert check in found, found
    assert found[check].grade == grade
    assert found[check].what
    assert found[check].do
    assert found[check].where


def test_a_magnitude_in_the_place_of_a_component_is_told() -> None:
    good = of_springs(both_ways())
    assert graded(replace(good, wrench=np.abs(good.wrench)))["sign of forces"].grade == "wrong"


@pytest.mark.parametrize("factor", [1e3, 1e-6])
def test_forces_in_another_unit_are_told_by_the_stiffness(factor: float) -> None:
    """With the noise in that unit as well, nothing else is out of place."""
    soft = 0.1 if factor > 1 else 1.0
    small = replace(GOOD, wrench=GOOD.wrench * soft)
    wrong = replace(
        small,
        wrench=small.wrench * factor,
        sensor=replace(
            small.sensor,
            force_std=small.sensor.force_std * factor * soft,
            torque_std=small.sensor.torque_std * factor * soft,
        ),
    )
    assert graded(wrong)["units of forces"].grade == "suspicious"
