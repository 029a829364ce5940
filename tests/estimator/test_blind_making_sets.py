"""Sets of cases: what they hold, that their answers lie apart, and that making them can be broken off."""

import shutil
import tomllib
from collections import Counter
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from blind_scenes import BASELINE, BEADS, baseline, drawn

from estimator.blind.making.case import Made, write_case
from estimator.blind.making.effects.catalogue import FORM_SETS, FORMS, GROUP_OF, FormSet, form_named, forms_of
from estimator.blind.making.making import make_cases
from estimator.blind.making.plan import deck_size, plan
from estimator.blind.making.scenes.noise import NOISE_KINDS, NoiseKind, with_noise
from estimator.blind.making.scenes.outline import Cylinder, Organ
from estimator.blind.making.scenes.retraction import KINDS, Manner, rows_of
from estimator.blind.making.scenes.scene import Scene
from estimator.blind.making.scenes.setup import SENSOR, Setup, draw_setup
from estimator.blind.making.scenes.simulate import TRIAL, carry_out, held_body
from estimator.blind.making.scenes.sizing import Pilot, sized
from estimator.blind.making.scenes.stated import experiments_of
from estimator.blind.making.scenes.wide_setup import WITH_PARTS, draw_wide_setup
from estimator.errors import InputError
from estimator.experiment import read_case
from estimator.experiment.model import TrajectoryKind
from estimator.surfaces.reading import read_surface
from estimator.workers import worker_pool

BRIEF = Manner(long_hold=(5.0,), steps=0.2)


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


@pytest.mark.parametrize("form_set", FORM_SETS)
def test_another_seed_takes_other_forms(form_set: FormSet) -> None:
    plans = [plan(seed, 54, form_set=form_set) for seed in (1, 2)]
    forms = [{case.labels: case.forms for case in cases if len(case.labels) == 1} for cases in plans]
    several = [(label,) for label, known in forms_of(form_set).items() if len(known) > 1]
    assert all(forms[0][label] != forms[1][label] for label in several)


def test_a_seed_of_the_catalogue_plans_what_it_always_did() -> None:
    cases = plan(50, 5, form_set="catalogue")
    assert [(case.labels[0], case.forms[0], case.levels[0]) for case in cases] == [
        ("anchor_debonding", "failing_glue", "clear"),
        ("force_drift", "linear", "clear"),
        ("second_invariant", "mooney_rivlin", "clear"),
        ("gripper_compliance", "translation", "clear"),
        ("support_friction", "coulomb_where_it_lies", "large"),
    ]
    assert not any(case.wide for case in cases)


def test_a_mixed_deck_has_forms_of_both_hands() -> None:
    singles = [case for case in plan(3, deck_size()) if len(case.labels) == 1 and case.labels[0] in FORMS]
    own = {label: {form.name for form in forms} for label, forms in FORMS.items()}
    old = [case for case in singles if case.forms[0] in own[case.labels[0]]]
    assert 8 <= len(old) <= len(singles) - 8


def test_wide_setups_are_of_every_kind_and_suit_the_forms() -> None:
    setups = [draw_wide_setup(np.random.default_rng(seed), ()) for seed in range(150)]
    assert {setup.mechanics.beads for setup in setups} == {0, 6, 16, 60}
    assert {type(setup.mechanics.outline) for setup in setups} == {type(None), Organ, Cylinder}
    assert {setup.mechanics.two_sides for setup in setups} == {True, False}
    noise = [setup.sensor.force_std / SENSOR.force_std for setup in setups]
    assert 0.2 <= min(noise) < 0.3 and 4.0 < max(noise) <= 5.0
    assert len({setup.manner.hold for setup in setups}) > 10
    friction, exchange = (
        form_named("support_friction", "patches"),
        form_named("fiducial_mislabel", "now_and_then"),
    )
    for seed in range(40):
        setup = draw_wide_setup(np.random.default_rng(seed), (friction, exchange))
        assert setup.mechanics.outline is None
        assert len(setup.beads) == setup.mechanics.beads >= 2


@pytest.mark.parametrize("seed", range(8))
def test_organs_with_parts_are_drawn_where_the_forms_allow_them(seed: int) -> None:
    setup = draw_wide_setup(np.random.default_rng(seed), (), WITH_PARTS)
    assert isinstance(setup.mechanics.outline, Organ)
    assert [part.kind for part in setup.mechanics.parts] == ["cavity", "region"]
    on_block = draw_wide_setup(
        np.random.default_rng(seed), (form_named("support_friction", "patches"),), WITH_PARTS
    )
    assert on_block.mechanics.parts == ()


def test_a_set_is_limited_to_organs_with_parts() -> None:
    assert {case.body for case in plan(1, 5, body=WITH_PARTS)} == {WITH_PARTS}
    with pytest.raises(InputError, match="the forms of the catalogue are on blocks alone"):
        plan(1, 5, form_set="catalogue", body=WITH_PARTS)
    with pytest.raises(InputError, match="'heart' is no body; choose from organ_with_parts"):
        plan(1, 5, body="heart")


@pytest.mark.parametrize(
    ("seed", "body"),
    [(1, ""), (4, ""), (5, ""), (2, WITH_PARTS)],
    ids=["cylinder", "force alone", "organ", "organ with parts"],
)
def test_any_phantom_can_be_carried_out_written_and_read(seed: int, body: str, tmp_path: Path) -> None:
    setup = replace(draw_wide_setup(np.random.default_rng(seed), (), body), order=("pull",))
    scene, outline = Scene(setup.mechanics), setup.mechanics.outline
    carried = carry_out(scene.mechanics, setup.experiments, setup.beads, TRIAL)
    experiments = experiments_of(setup, scene, carried.readings, np.random.default_rng(1))
    made = Made(experiments, {}, outline, setup.mechanics.parts)
    write_case(made, tmp_path / "case", tmp_path / "key.toml")
    (found,) = read_case(tmp_path / "case")
    assert found.phantom.shape == ("block" if outline is None else "surface")
    assert len(found.phantom.regions) == bool(body)
    if found.phantom.surface is None:
        return
    held = held_body(setup.mechanics, TRIAL)
    volumes, stiffness = held.body.quadrature.volumes, held.material.stiffness
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(read_surface(found.phantom.surface).surface.volume_m3, rel=0.02)
    for region in found.phantom.regions:
        stiffer = stiffness == region.modulus_ratio
        stated = read_surface(region.surface).surface.volume_m3
        assert volumes.ravel()[stiffer].sum() == pytest.approx(stated, rel=0.05)
    assert set(stiffness) == {1.0, *(region.modulus_ratio for region in found.phantom.regions)}
    assert found.fiducials.shape[1] == setup.mechanics.beads
    assert found.wrench[:, 0].min() < -0.1


@pytest.mark.parametrize(
    ("label", "form"),
    [
        ("force_drift", "periodic"),
        ("time_offset", "low_pass"),
        ("camera_scale", "rest_measured_too"),
    ],
)
def test_a_form_is_drawn_as_large_as_it_is_asked_for(label: str, form: str, pull_pilot: Pilot) -> None:
    known = form_named(label, form)
    found = sized(pull_pilot, lambda size: drawn(known, size), known, 20.0)
    assert found.sigma == pytest.approx(20.0, rel=0.25)


@pytest.fixture(scope="module")
def pull_pilot() -> Pilot:
    """One short pull of the usual phantom."""
    return Pilot(Setup(BASELINE, ("pull",), BRIEF, BEADS, "standard", "P1"))


def test_a_foreign_set_keeps_its_answers_apart_and_comes_out_the_same(tmp_path: Path) -> None:
    cases = plan(1, 1, ["time_offset"], form_set="others")
    for name in ("one", "again"):
        assert (
            make_cases(
                cases, tmp_path / name, tmp_path / f"{name}-keys", workers=partial(worker_pool, 1), quick=True
            ).failed
            == {}
        )
    files = [file for file in sorted((tmp_path / "one").glob("*/**/*")) if file.is_file()]
    assert {file.name for file in files} <= {"experiment.toml", "observations.csv", "phantom.stl"}
    for file in files:
        assert file.read_bytes() == (tmp_path / "again" / file.relative_to(tmp_path / "one")).read_bytes()
        if file.suffix == ".toml":
            told = file.read_text()
            assert not any(
                word in told for case in cases for word in (*case.labels, *case.forms, "in_family")
            )
    for case in cases:
        truth = tomllib.loads((tmp_path / "one-keys" / f"{case.name}.toml").read_text())
        assert truth["generator"]["in_family"] in ("exact", "near", "far")
        assert truth["generator"]["form"] == list(case.forms)


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
        done = make_cases(
            plan(5, 2, ["none"], form_set="catalogue"), out, keys, workers=partial(worker_pool, 2), quick=True
        )
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
    before, hashes = table.read_bytes(), (out / "keys.sha256").read_bytes()
    shutil.rmtree(out / "case002")
    assert make() == (("case002",), ("case001",))
    assert table.read_bytes() == before
    assert (out / "keys.sha256").read_bytes() == hashes


def test_a_region_stands_out_in_proportion_to_how_much_stiffer_it_is() -> None:
    # And not by the finer mesh that it is solved on.
    setup = replace(draw_setup(np.random.default_rng(3), ()), order=("pull",), manner=BRIEF)
    form = next(form for form in FORMS["inhomogeneity"] if form.name == "stiff_ball")
    pilot = Pilot(setup, TRIAL)
    effects = [form.draw(np.random.default_rng(5), size, setup.mechanics) for size in (0.02, 0.04)]
    slight, double = map(pilot.sigma, effects)
    assert double == pytest.approx(2 * slight, rel=0.1)
    scene = effects[1].change(Scene(setup.mechanics))
    carried = carry_out(scene.mechanics, setup.experiments, setup.beads, TRIAL)
    assert pilot.sigma_as_made(scene, carried, TRIAL) == pytest.approx(double, rel=1e-6)


def test_answers_among_the_cases_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="among the cases"):
        make_cases(plan(1, 1), tmp_path, tmp_path / "keys")
