"""`retract check`: a good experiment has nothing to say, and one that is spoiled in one way is told what."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from retraction_cases import SMALL_BLOCK, from_rest, recorded, straight_pull
from scipy.spatial.transform import Rotation

from daq.cli import main
from estimator.errors import EstimatorError, FitError, SolverError
from estimator.experiment import Box, Environment, Experiment, Grasp, write_experiment
from estimator.experiment.model import Weight
from estimator.experiment_checks import Finding, check_folder, findings_of
from estimator.experiment_checks.suspicions import naming_suspicions
from estimator.experiment_checks.telling import as_text
from estimator.fem.boundary.motion import GripperPose
from estimator.fem.equilibrium.observation import Observation

STIFFNESS = np.array([400.0, 300.0, 250.0])  # N/m, of a block of some tens of kPa


def of_springs(poses: list[GripperPose], noise: float = 1.0, seed: int = 0) -> Experiment:
    """What a block of linear springs answers, whose beads follow by their place between anchor and grasp."""
    rest = SMALL_BLOCK
    centre, half = np.array(rest.grasp.centre), rest.phantom.size_m[0] / 2
    share = (rest.fiducials_rest[:, :1] + half) / (centre[0] + half)
    seen = []
    for pose in poses:
        moved = np.asarray(pose.position) - centre
        force = np.concatenate([-STIFFNESS * moved, -0.05 * pose.rotation.as_rotvec()])
        seen.append(Observation(force, rest.fiducials_rest + share * moved, {}, {}, None, None, {}))
    return recorded(rest, poses, seen, np.random.default_rng(seed), noise=noise)


def there_and_back() -> list[GripperPose]:
    pull = straight_pull(SMALL_BLOCK, 0.008, 4)
    return from_rest(
        SMALL_BLOCK,
        [*pull, *pull[-2::-1], GripperPose(np.array(SMALL_BLOCK.grasp.centre), Rotation.identity())],
    )


def both_ways() -> list[GripperPose]:
    return from_rest(
        SMALL_BLOCK, [*straight_pull(SMALL_BLOCK, 0.006, 3), *straight_pull(SMALL_BLOCK, -0.006, 3)]
    )


GOOD = of_springs(there_and_back())


def graded(experiment: Experiment) -> dict[str, Finding]:
    """The first finding of each check, without those of which nothing is to be said."""
    found: dict[str, Finding] = {}
    for finding in findings_of(experiment):
        found.setdefault(finding.check, finding)
    return found


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("path", [there_and_back, both_ways])
def test_a_good_experiment_has_nothing_to_say(path: Callable[[], list[GripperPose]], seed: int) -> None:
    assert findings_of(of_springs(path(), seed=seed)) == []


def hung(experiment: Experiment) -> Experiment:
    """The forces of each step as if they were known."""
    return replace(experiment, wrench=experiment.wrench[np.searchsorted(experiment.step, experiment.step)])


def wrench(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Experiment], Experiment]:
    return lambda good: replace(good, wrench=change(good.wrench.copy()))


def beads(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Experiment], Experiment]:
    return lambda good: replace(good, fiducials=change(good.fiducials.copy()))


def rest(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Experiment], Experiment]:
    return lambda good: replace(good, fiducials_rest=change(good.fiducials_rest.copy()))


def stated(**values: object) -> Callable[[Experiment], Experiment]:
    return lambda good: replace(good, **values)


def sensor(**values: float) -> Callable[[Experiment], Experiment]:
    return lambda good: replace(good, sensor=replace(good.sensor, **values))


def phantom(**values: object) -> Callable[[Experiment], Experiment]:
    return lambda good: replace(good, phantom=replace(good.phantom, **values))


def with_rows(
    order: Callable[[int], list[int]], *, times_too: bool = True
) -> Callable[[Experiment], Experiment]:
    """The rows in another order, some of them twice; with their times, or without."""

    def changed(good: Experiment) -> Experiment:
        chosen = order(len(good.time))
        return replace(
            good,
            time=good.time[chosen] if times_too else np.arange(len(chosen), dtype=float),
            phase=tuple(good.phase[i] for i in chosen),
            step=good.step[chosen],
            position=good.position[chosen],
            quaternion_wxyz=good.quaternion_wxyz[chosen],
            wrench=good.wrench[chosen],
            fiducials=good.fiducials[chosen],
        )

    return changed


def column(values: np.ndarray, place: object, change: Callable[[np.ndarray], object]) -> np.ndarray:
    values[place] = change(values[place])
    return values


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


@given(
    kept=st.sets(st.integers(0, 5), min_size=0, max_size=6),
    beads_kept=st.sets(st.integers(0, 8), min_size=0, max_size=9),
    rows=st.integers(2, len(GOOD.time)),
    flat=st.booleans(),
)
@settings(max_examples=60, deadline=None)
def test_what_is_not_measured_is_no_fault(
    kept: set[int], beads_kept: set[int], rows: int, flat: bool
) -> None:
    """Channels, beads and rows that are left out make nothing suspicious, as long as something is measured."""
    readings, points = GOOD.wrench.copy(), GOOD.fiducials.copy()
    readings[:, [axis for axis in range(6) if axis not in kept]] = np.nan
    points[:, [bead for bead in range(9) if bead not in beads_kept]] = np.nan
    if flat:
        points[:, :, 2] = np.nan
    less = with_rows(lambda _: list(range(rows)))(replace(GOOD, wrench=readings, fiducials=points))
    found = [finding for finding in findings_of(less) if finding.check != "what is measured"]
    assert found == []


def written(experiment: Experiment, folder: Path) -> Path:
    write_experiment(experiment, folder)
    return folder


def test_the_command_tells_each_finding_in_a_line_and_by_its_status(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = written(GOOD, tmp_path / "pull")
    assert main(["check", str(folder)]) == 0
    assert capsys.readouterr().out.startswith("fine")
    table = folder / "observations.csv"
    lines = table.read_text(encoding="utf-8").splitlines()
    table.write_text("\n".join([*lines[:10], lines[9], *lines[10:]]), encoding="utf-8")
    assert main(["check", str(folder)]) == 2
    said = capsys.readouterr().out.splitlines()
    assert any(
        "observations.csv, line 11, column time: the same time as in the row before" in line for line in said
    )
    assert main(["check", str(folder), "--json"]) == 2
    told = json.loads(capsys.readouterr().out)
    assert told["wrong"]
    assert {(f["file"], f["line"]) for f in told["folders"][0]["findings"]} == {("observations.csv", 11)}


def test_what_is_suspicious_ends_with_status_0(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = written(wrench(lambda w: column(w, np.s_[:, 1], lambda _: 0.0))(GOOD), tmp_path / "pull")
    assert main(["check", str(folder)]) == 0
    assert capsys.readouterr().out.startswith("suspicious")


@pytest.mark.parametrize("error", [FitError, SolverError])
def test_what_is_suspicious_is_said_with_a_failure_that_it_may_have_caused(
    error: type[EstimatorError], tmp_path: Path
) -> None:
    good, spoiled = written(GOOD, tmp_path / "good"), written(hung(GOOD), tmp_path / "hung")
    with pytest.raises(error, match=r"^it fails$"), naming_suspicions([good]):
        raise error("it fails")
    with (
        pytest.raises(error, match=r"it fails; suspicious in .*driven: the forces are"),
        naming_suspicions([spoiled]),
    ):
        raise error("it fails")


@pytest.mark.parametrize(
    ("file", "old", "new", "place"),
    [
        ("experiment.toml", "size = [0.06", "size = [60.0", "experiment.toml [phantom] size"),
        ("experiment.toml", "[sensor]", "[sensors]", "experiment.toml: [sensor] force_std"),
        ("observations.csv", "ramp", "rmap", "observations.csv, line 2, column phase"),
        ("observations.csv", "hold", "12", "observations.csv, line 2, column phase"),
    ],
)
def test_a_folder_that_cannot_be_read_has_that_as_its_finding(
    tmp_path: Path, file: str, old: str, new: str, place: str
) -> None:
    folder = written(
        replace(GOOD, phase=("ramp" if old == "ramp" else "hold",) * len(GOOD.time)), tmp_path / "pull"
    )
    content = (folder / file).read_text(encoding="utf-8")
    (folder / file).write_text(content.replace(old, new), encoding="utf-8")
    (checked,) = check_folder(folder)
    assert checked.wrong
    assert place in as_text([checked])


@pytest.mark.parametrize(
    ("second", "check", "grade"),
    [
        (replace(GOOD, order=2), "repeated experiments", "wrong"),
        (of_springs(there_and_back(), seed=5), "order of experiments", "suspicious"),
        (replace(of_springs(there_and_back(), seed=5), order=2, phantom_id="P02"), "one phantom", "wrong"),
    ],
)
def test_the_experiments_of_a_case_are_compared(
    tmp_path: Path, second: Experiment, check: str, grade: str
) -> None:
    written(GOOD, tmp_path / "case" / "a")
    written(second, tmp_path / "case" / "b")
    *members, together = check_folder(tmp_path / "case")
    assert [member.findings for member in members] == [(), ()]
    assert {finding.check: finding.grade for finding in together.findings} == {check: grade}
    assert together.findings[0].where.startswith("b/")


def test_a_case_of_two_good_experiments_has_nothing_to_say(tmp_path: Path) -> None:
    written(GOOD, tmp_path / "case" / "a")
    written(replace(of_springs(both_ways(), seed=5), order=2), tmp_path / "case" / "b")
    assert [one.findings for one in check_folder(tmp_path / "case")] == [(), (), ()]


@pytest.mark.parametrize(("share", "said"), [(0.5, True), (0.3, False), (1.0, False)])
def test_a_load_that_is_half_the_weight_is_pointed_out_where_the_weight_acts(
    share: float, said: bool
) -> None:
    weight = float(np.prod(GOOD.phantom.size_m)) * GOOD.phantom.density * 9.81
    load = np.full_like(GOOD.wrench, np.nan)
    load[:, :3] = np.outer(GOOD.step > 0, [0.0, 0.0, share * weight])
    sensor = replace(GOOD.sensor, orientation_std=0.01)
    environment = Environment(surface_below="none", weight="acts_after_first_row")
    hanging = replace(GOOD, driven="load", wrench=load, sensor=sensor, environment=environment)
    assert ("weight" in graded(hanging)) == said


def test_what_begins_under_load_may_stand_anywhere() -> None:
    later = of_springs(there_and_back()[3:])
    assert "start" in graded(later)
    assert graded(replace(later, first_row="under_load")) == {}


@pytest.mark.parametrize("weight", ["acts", "acts_after_first_row"])
def test_a_phantom_that_hangs_by_its_grasp_and_anchors_has_nothing_to_be_told(weight: Weight) -> None:
    """Where it acts from the first row on, beads hang below their places and forces are absolute."""
    hung = replace(
        GOOD,
        environment=Environment(surface_below="none", weight=weight),
        sensor=replace(GOOD.sensor, force_zero="no_load"),
    )
    if weight == "acts":
        hung = replace(
            hung,
            wrench=hung.wrench + np.array([0.0, 0.0, -0.09, 0.0, 0.0, 0.0]),
            fiducials=hung.fiducials + np.array([0.0, 0.0, -1e-3]),
        )
    assert graded(hung) == {}
