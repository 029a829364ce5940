"""Sets of cases: what they hold, that their answers lie apart, and that making them can be broken off."""

import shutil
import tomllib
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blind_scenes import baseline

from estimator.blind.making.effects.catalogue import FORMS, GROUP_OF
from estimator.blind.making.making import make_cases
from estimator.blind.making.plan import deck_size, plan
from estimator.blind.making.scenes.noise import NOISE_KINDS, NoiseKind, with_noise
from estimator.blind.making.scenes.retraction import KINDS, Manner, rows_of
from estimator.blind.making.scenes.scene import Scene
from estimator.blind.making.scenes.setup import SENSOR, draw_setup
from estimator.blind.making.scenes.simulate import PILOT, carry_out
from estimator.blind.making.scenes.sizing import Pilot
from estimator.errors import InputError
from estimator.experiment import read_case
from estimator.experiment.model import TrajectoryKind


def test_a_deck_holds_every_label_once_and_clean_unknown_and_double_cases() -> None:
    cases = plan(3, deck_size())
    kinds = Counter(case.labels for case in cases)
    assert kinds[()] == 8
    assert kinds[("unknown",)] == 8
    assert all(kinds[(label,)] == 1 for label in FORMS)
    doubles = [case.labels for case in cases if len(case.labels) == 2]
    assert len(doubles) == 6
    assert all(GROUP_OF[one] != GROUP_OF[other] for one, other in doubles)


def test_a_plan_depends_on_its_seed_alone_and_its_order_tells_nothing() -> None:
    assert plan(3, 54) == plan(3, 54)
    first, second = plan(3, 54), plan(4, 54)
    assert [case.labels for case in first] != [case.labels for case in second]


def test_another_seed_takes_other_forms() -> None:
    forms = [{case.labels: case.forms for case in plan(seed, 54) if len(case.labels) == 1} for seed in (1, 2)]
    several = [(label,) for label, known in FORMS.items() if len(known) > 1]
    assert all(forms[0][label] != forms[1][label] for label in several)


@pytest.mark.parametrize(
    ("count", "only", "levels"), [(0, (), ()), (1, ("wobble",), ()), (1, (), ("gigantic",))]
)
def test_an_impossible_plan_is_refused(count: int, only: tuple[str, ...], levels: tuple[str, ...]) -> None:
    with pytest.raises(InputError):
        plan(1, count, only, levels)


@pytest.mark.parametrize(
    ("kind", "count"), [("pull", 49), ("gradual_tangent_pull", 79), ("twist_and_pull", 49)]
)
def test_a_retraction_has_ramps_holds_and_a_way_back(kind: TrajectoryKind, count: int) -> None:
    rows = rows_of(kind, 1, Manner())
    assert len(rows.time) == count
    assert np.all(np.diff(rows.time) > 0)
    assert set(rows.phase) == {"ramp", "hold", "return", "return_hold"}
    assert rows.travel.max() == pytest.approx(0.02)
    assert rows.travel[-1] == pytest.approx(0.0)


@pytest.mark.parametrize("kind", NOISE_KINDS)
def test_noise_of_every_structure_has_about_the_stated_size(kind: NoiseKind) -> None:
    random = np.random.default_rng(1)
    reading = baseline().readings[0]
    wrench = [with_noise(reading, SENSOR, kind, random).wrench - reading.wrench for _ in range(60)]
    assert np.std(np.array(wrench)[..., :3]) == pytest.approx(0.02, rel=0.15)


def test_a_setup_lies_in_the_stated_ranges() -> None:
    for seed in range(30):
        setup = draw_setup(np.random.default_rng(seed), ())
        assert 4e3 <= setup.mechanics.law.youngs_modulus <= 30e3
        assert 0.37 <= setup.mechanics.law.poisson_ratio <= 0.48
        assert sorted(setup.order) == sorted(KINDS)
        assert np.all(np.abs(setup.beads[:, :2]) < 0.035)


def test_a_set_can_be_broken_off_and_comes_out_the_same(tmp_path: Path) -> None:
    out, keys = tmp_path / "cases", tmp_path / "keys"

    def make() -> tuple[tuple[str, ...], tuple[str, ...]]:
        done = make_cases(plan(5, 2, ["none"]), out, keys, processes=2, quick=True)
        assert done.failed == {}
        return done.made, done.present

    assert make() == (("case001", "case002"), ())
    for name in ("case001", "case002"):
        experiments = read_case(out / name)
        assert [experiment.order for experiment in experiments] == [1, 2, 3]
        assert {experiment.trajectory_kind for experiment in experiments} == set(KINDS)
        assert not list((out / name).rglob("truth*"))
        truth = tomllib.loads((keys / f"{name}.toml").read_text())
        assert truth["effects"] == []
        assert truth["generator"]["anchors"] in ("one", "two")
    table = out / "case002" / "pull" / "observations.csv"
    before = table.read_bytes()
    shutil.rmtree(out / "case002")
    assert make() == (("case002",), ("case001",))
    assert table.read_bytes() == before


def test_a_region_stands_out_in_proportion_to_how_much_stiffer_it_is() -> None:
    # And not by the finer mesh that it is solved on.
    setup = replace(draw_setup(np.random.default_rng(3), ()), order=("pull",))
    form = next(form for form in FORMS["inhomogeneity"] if form.name == "stiff_ball")
    pilot = Pilot(setup)
    drawn = [form.draw(np.random.default_rng(5), size, setup.mechanics) for size in (0.02, 0.04)]
    slight, double = map(pilot.sigma, drawn)
    assert double == pytest.approx(2 * slight, rel=0.1)
    scene = drawn[1].change(Scene(setup.mechanics))
    carried = carry_out(scene.mechanics, setup.experiments, setup.beads, PILOT)
    assert pilot.sigma_as_made(scene, carried, PILOT) == pytest.approx(double, rel=1e-6)


def test_answers_among_the_cases_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="among the cases"):
        make_cases(plan(1, 1), tmp_path, tmp_path / "keys")
