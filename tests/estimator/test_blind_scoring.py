"""Answering sealed cases and scoring the answers, with a stand-in for the diagnosis."""

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from synthetic_diagnoses import diagnosis, inclusion, no_gap, small_experiment

from estimator.blind.scoring.intervals import Figure
from estimator.blind.scoring.keys import open_keys
from estimator.blind.scoring.running import answer_cases
from estimator.blind.scoring.score import Score, score_answers
from estimator.blind.scoring.telling import score_text, write_score
from estimator.diagnosis.conclusions.as_json import as_json
from estimator.diagnosis.result import Diagnosis, Material, Quantity
from estimator.errors import FitError, InputError
from estimator.experiment import Experiment, write_experiment
from estimator.workers import worker_pool


def stand_in(experiments: Sequence[Experiment], tell: Callable[[str, int, int], None] | None) -> Diagnosis:
    """Name the inclusion where the first experiment is a pull, otherwise nothing; refuse a tangent."""
    if experiments[0].name == "tangent":
        raise FitError("the data do not determine the parameters")
    return inclusion() if experiments[0].name == "pull" else no_gap()


def make_cases(folder: Path, names: Mapping[str, str]) -> Path:
    """A folder of cases, each with one experiment of the given name, and with a key that is no key."""
    for case, name in names.items():
        write_experiment(small_experiment(name), folder / case / name)
        (folder / case / "truth.toml").write_text("this is no TOML and must not be read")
    return folder


def key(effects: Sequence[str], level: str = "clear", sigma: Sequence[float] = (), **where: object) -> str:
    told = [f"effects = {json.dumps(list(effects))}", "youngs_modulus = 26000.0", "poisson_ratio = 0.48", ""]
    if where:
        told += ["[where]", *(f"{name} = {json.dumps(value)}" for name, value in where.items()), ""]
    told += ["[generator]", f"level = {json.dumps(level)}"]
    return "\n".join([*told, *([f"sigma = {list(sigma)}"] if sigma else [])])


def answer(verdict: tuple[str, ...], probabilities: dict[str, float], **changes: object) -> dict[str, Any]:
    return as_json(diagnosis(verdict, probabilities, **changes))  # type: ignore[arg-type]  # fields by name


def with_ceiling(told: dict[str, Any], **share: float) -> dict[str, Any]:
    """The answer with a ceiling of labels that is so high at 10 sigma and nothing at 1."""
    return {
        **told,
        "ceiling": {label: {"sigma": [1.0, 10.0], "share": [0.0, high]} for label, high in share.items()},
    }


def scored(folder: Path, cases: Mapping[str, tuple[str, dict[str, Any]]]) -> Score:
    """The score of cases given by key and answer."""
    (folder / "keys").mkdir(parents=True)
    (folder / "answers").mkdir()
    for name, (truth, told) in cases.items():
        (folder / "keys" / f"{name}.toml").write_text(truth)
        (folder / "answers" / f"{name}.json").write_text(json.dumps(told))
    return score_answers([(folder / "answers", folder / "keys")])


def values(score: Score) -> dict[str, Figure]:
    return {metric.name: metric.figure for metric in score.metrics}


@pytest.fixture
def mixed(tmp_path: Path) -> Score:
    """Five singles, two clean cases, two outside the catalogue, two doubles."""
    slip, bias = {"gripper_slip": 0.95, "none": 0.05}, {"force_bias": 0.6, "none": 0.3, "unknown": 0.1}
    region = as_json(inclusion())
    one_of_two = answer(("gripper_slip", "force_bias"), slip)
    return scored(
        tmp_path,
        {
            "right": (key(["gripper_slip"]), answer(("gripper_slip",), slip)),
            "group": (key(["gripper_compliance"]), answer(("gripper_slip",), slip)),
            "third": (
                key(["force_drift"], "subtle"),
                answer((), {"none": 0.5, "unknown": 0.3, "force_drift": 0.2}),
            ),
            "place": (
                key(["inhomogeneity"], "clear", centre=[-0.0113, 0.0192, 0.003], radius=0.01),
                region,
            ),
            "spurious": (key(["gripper_slip"], "subtle"), one_of_two),
            "clean": (key([], ""), answer((), {"none": 0.9, "unknown": 0.1})),
            "alarm": (key([], ""), answer(("force_bias",), bias)),
            "outside": (key(["air_bubble"]), answer(("unknown",), {"unknown": 0.8, "none": 0.2})),
            "misled": (key(["unknown"]), answer(("gripper_slip",), slip)),
            "both": (key(["gripper_slip", "force_bias"], "clear and subtle"), one_of_two),
            "one": (key(["gripper_slip", "camera_scale"]), one_of_two),
        },
    )


def test_names_are_scored_by_label_group_and_rank(mixed: Score) -> None:
    found = values(mixed)
    assert found["single cause: top-1"].value == pytest.approx(3 / 5)
    assert found["single cause: top-3"].value == pytest.approx(4 / 5)
    assert found["single cause: right group"].value == pytest.approx(4 / 5)
    assert found["single cause: some gap seen"].value == pytest.approx(4 / 5)
    assert found["single cause: a spurious second"].value == pytest.approx(1 / 5)


def test_causes_that_stand_out_plainly_are_also_scored_by_themselves(tmp_path: Path) -> None:
    slip = answer(("gripper_slip",), {"gripper_slip": 0.95, "none": 0.05})
    third = answer((), {"none": 0.5, "unknown": 0.3, "force_drift": 0.2})
    plain, missed, faint, unsaid = (
        key(["gripper_slip"], sigma=[6.0]),
        key(["force_drift"], sigma=[7.0]),
        key(["force_bias"], sigma=[5.9]),
        key(["force_bias"]),
    )
    found = values(
        scored(tmp_path, {"a": (plain, slip), "b": (missed, third), "c": (faint, slip), "d": (unsaid, slip)})
    )
    assert found["single cause: top-1"].count == 4
    for asked, share in (("top-1", 0.5), ("top-3", 1.0), ("right group", 0.5)):
        figure = found[f"of those from 6 σ on: {asked}"]
        assert (figure.value, figure.count) == (share, 2)


def test_the_ceiling_at_the_cases_own_sigma_stands_beside_the_score(tmp_path: Path) -> None:
    slip = with_ceiling(
        answer(("gripper_slip",), {"gripper_slip": 0.95, "none": 0.05}), gripper_slip=0.8, force_bias=0.6
    )
    far, near = key(["gripper_slip"], sigma=[40.0]), key(["force_bias"], sigma=[10.0**0.5])
    score = scored(tmp_path, {"a": (far, slip), "b": (near, slip)})
    top = next(metric for metric in score.metrics if metric.name == "single cause: top-1")
    assert top.ceiling == pytest.approx((0.8 + 0.3) / 2)
    line = next(line for line in score_text(score).splitlines() if line.startswith("single cause: top-1"))
    assert line.endswith("55.0 %")


def test_two_causes_are_named_no_oftener_than_the_one_that_is_harder_to_name(tmp_path: Path) -> None:
    told = with_ceiling(answer(("gripper_slip",), {"gripper_slip": 1.0}), gripper_slip=0.8, force_bias=0.6)
    both = key(["gripper_slip", "force_bias"], sigma=[10.0, 10.0**0.5])
    found = {metric.name: metric.ceiling for metric in scored(tmp_path, {"a": (both, told)}).metrics}
    assert found["several causes: all named"] == pytest.approx(0.3)
    assert found["several causes: at least one"] is None


def test_a_ceiling_that_is_known_of_only_some_cases_is_left_out(tmp_path: Path) -> None:
    told = with_ceiling(answer(("gripper_slip",), {"gripper_slip": 0.95, "none": 0.05}), gripper_slip=0.8)
    stated, silent = key(["gripper_slip"], sigma=[12.0]), key(["gripper_slip"])
    score = scored(tmp_path, {"a": (stated, told), "b": (silent, told)})
    assert {metric.ceiling for metric in score.metrics if "calibration" not in metric.name} == {None}


def test_an_answer_that_was_run_holds_the_ceiling_of_what_it_looked_for(tmp_path: Path) -> None:
    cases = make_cases(tmp_path / "cases", {"a": "pull"})
    answer_cases(stand_in, cases, tmp_path / "answers")
    told = json.loads((tmp_path / "answers" / "a.json").read_text())["ceiling"]
    assert set(told) == set(inclusion().rivals.labels)


def test_alarms_unknowns_and_confident_errors_are_counted(mixed: Score) -> None:
    found = values(mixed)
    assert found["no gap: false alarms"].value == pytest.approx(1 / 2)
    assert found["outside the catalogue: recognised"].value == pytest.approx(1 / 2)
    assert found["outside the catalogue: confidently wrong"].value == pytest.approx(1 / 2)
    assert found["all cases: confidently wrong"].value == pytest.approx(2 / 11)


def test_doubles_are_scored_by_what_they_share_with_the_truth(mixed: Score) -> None:
    found = values(mixed)
    assert found["several causes: all named"].value == pytest.approx(1 / 2)
    assert found["several causes: at least one"].value == pytest.approx(1.0)
    assert found["several causes: a spurious one"].value == pytest.approx(1 / 2)


def test_place_block_closure_and_material_are_scored(mixed: Score) -> None:
    found = values(mixed)
    assert found["place error, median"].value == pytest.approx(5.0)
    assert found["local cause: a place is given"].count == 1
    # the stand-in says "anchor" unless it has found the inclusion
    assert found["right block of the rig"].value == pytest.approx(1 / 5)
    assert found["single cause: closure on held-out data, median"].value == pytest.approx(0.94)
    assert found["rightly named: error of E before, median"].value == pytest.approx(1900 / 26_000)
    assert found["rightly named: E within 3 % after"].value == pytest.approx(1.0)
    assert found["rightly named: error of ν before, median"].value == pytest.approx(0.049)
    assert found["rightly named: error of ν after, median"].value == pytest.approx(0.002)
    # 26.05 kPa ± 0.18 where 26 is true, and 0.482 ± 0.003 where 0.48 is
    assert found["one cause or none: E in its 95 % interval"].count == 7
    assert found["one cause or none: ν in its 95 % interval"].value == pytest.approx(1.0)


def test_an_interval_that_misses_the_truth_counts_against_the_diagnosis(tmp_path: Path) -> None:
    sure = Material(Quantity(25_000.0, 100.0, "Pa"), Quantity(0.47, 0.02, "1"))
    told = answer(("gripper_slip",), {"gripper_slip": 1.0}, after=sure)
    found = values(scored(tmp_path, {"a": (key(["gripper_slip"]), told)}))
    assert found["one cause or none: E in its 95 % interval"].value == 0.0
    assert found["one cause or none: ν in its 95 % interval"].value == 1.0


def test_the_usual_time_of_a_diagnosis_is_told_and_the_longest(tmp_path: Path) -> None:
    told = answer((), {"none": 1.0})
    cases = {str(n): (key([], ""), {**told, "seconds": n}) for n in (20.0, 30.0, 110.0)}
    found = values(scored(tmp_path, cases))
    assert found["time of a diagnosis, median"].value == pytest.approx(30.0)
    assert found["time of a diagnosis, the slowest"].value == pytest.approx(110.0)


def test_single_causes_are_also_scored_by_level(mixed: Score) -> None:
    top = {level: found[0].figure for level, found in mixed.by_level.items()}
    assert {level: (figure.value, figure.count) for level, figure in top.items()} == {
        "clear": (pytest.approx(2 / 3), 3),
        "subtle": (0.5, 2),
    }


def of_family(truth: str, family: str, block: str = "") -> str:
    """A key that tells how far the catalogue knows the form, and the block of what has no label."""
    return "\n".join([truth, f"in_family = {json.dumps(family)}", *([f'block = "{block}"'] if block else [])])


def at_block(told: dict[str, Any], block: str) -> dict[str, Any]:
    """The answer with most of the probability on one block."""
    return {**told, "where": {**told["where"], "blocks": {block: 0.9, "anchor": 0.1}}}


@pytest.fixture
def families(tmp_path: Path) -> Score:
    """Causes of exact, near and far forms, some laid to the right block by a label or by something unknown."""
    slip, sure = {"gripper_slip": 0.95, "none": 0.05}, {"unknown": 0.97, "none": 0.03}
    named = at_block(answer(("gripper_slip",), slip), "grasp")
    cameras = at_block(answer(("unknown",), sure), "vision")
    return scored(
        tmp_path,
        {
            "exact": (of_family(key(["gripper_slip"], sigma=[9.0]), "exact"), named),
            "near": (of_family(key(["gripper_compliance"], sigma=[9.0]), "near"), named),
            "far": (of_family(key(["camera_scale"], sigma=[9.0]), "far"), cameras),
            "faint": (
                of_family(key(["camera_rotation"], sigma=[4.0]), "far"),
                at_block(answer((), slip), "vision"),
            ),
            "outside": (of_family(key(["unknown"]), "far", "vision"), cameras),
            "elsewhere": (of_family(key(["unknown"]), "far", "force"), cameras),
            "clean": (key([], ""), answer((), {"none": 0.9, "unknown": 0.1})),
        },
    )


def test_exact_near_and_far_forms_are_scored_apart(families: Score) -> None:
    found = {name: {m.name: m.figure for m in metrics} for name, metrics in families.by_family.items()}
    assert list(found) == ["exact", "near", "far"]
    asked = "of those from 6 σ on: "
    assert [found[family][f"{asked}top-1"].value for family in found] == [1.0, 0.0, 0.0]
    assert [found[family][f"{asked}right group"].value for family in found] == [1.0, 1.0, 0.0]
    assert [found[family]["wrong with more than 0.9"].value for family in found] == pytest.approx(
        [0, 1, 1 / 2]
    )
    assert found["far"]["wrong with more than 0.9, and of the block"].value == pytest.approx(1 / 4)
    assert found["near"]["calibration error (15 bins)"].value == pytest.approx(0.95)
    assert found["exact"]["rightly named: E within 3 %"].count == 1
    assert found["far"]["rightly named: E within 3 %"].count == 0


def test_something_unknown_counts_for_the_block_that_it_is_laid_to(families: Score) -> None:
    found = {metric.name: metric.figure for metric in families.by_family["far"]}
    assert found["of those from 6 σ on: right block"].value == 1.0
    # Without a verdict nobody is told where to look.
    assert found["single cause: right block"].value == pytest.approx(1 / 2)
    assert found["outside the catalogue: right block"].value == pytest.approx(1 / 2)
    assert values(families)["right block of the rig"].value == pytest.approx(3 / 4)


def test_the_families_are_told_in_words_and_as_values(families: Score, tmp_path: Path) -> None:
    text = score_text(families)
    assert "forms that the catalogue has not" in text
    told = json.loads(json.dumps(families.as_json(), allow_nan=False))["by_family"]
    assert told["far"]["single cause: right block"]["cases"] == 2
    write_score(families, tmp_path / "score.html", "Score")
    assert "forms that the catalogue has nearly" in (tmp_path / "score.html").read_text()


def test_of_several_causes_the_least_known_form_counts(tmp_path: Path) -> None:
    both = key(["gripper_slip", "force_bias"], sigma=[9.0, 9.0]) + '\nin_family = ["exact", "far"]'
    score = scored(tmp_path, {"both": (both, answer(("gripper_slip", "force_bias"), {"gripper_slip": 1.0}))})
    (metrics,) = score.by_family.values()
    assert {m.name: m.figure.value for m in metrics}["several causes: all named"] == 1.0
    assert list(score.by_family) == ["far"]


def test_confusion_counts_every_case_with_one_answer(mixed: Score) -> None:
    names, counts = mixed.labels.names, mixed.labels.counts
    assert counts.sum() == 9
    assert counts[names.index("gripper_compliance"), names.index("gripper_slip")] == 1
    assert counts[names.index("none"), names.index("force_bias")] == 1
    groups = mixed.groups
    assert groups.counts[groups.names.index("grasp"), groups.names.index("grasp")] == 3


@pytest.mark.parametrize("suffix", ["html", "png"])
def test_a_score_is_a_page_or_a_picture(mixed: Score, tmp_path: Path, suffix: str) -> None:
    file = tmp_path / "made" / f"score.{suffix}"
    write_score(mixed, file, "Score of <these>")
    told = file.read_bytes()
    assert told.startswith(b"\x89PNG") if suffix == "png" else b"Score of &lt;these&gt;" in told
    if suffix == "html":
        assert b"outside the catalogue: recognised" in told
        assert b"Right as often as claimed" in told
        assert b"http:" not in told and b"https:" not in told


def test_pairs_alone_are_scored_without_what_single_answers_claim(tmp_path: Path) -> None:
    pair = key(["gripper_slip", "force_bias"])
    both = answer(("gripper_slip", "force_bias"), {"gripper_slip": 0.95, "none": 0.05})
    score = scored(tmp_path, {"a": (pair, both)})
    assert "claims" not in score_text(score)
    write_score(score, tmp_path / "score.png", "Pairs")
    write_score(score, tmp_path / "score.html", "Pairs")
    assert "Right as often as claimed" not in (tmp_path / "score.html").read_text(encoding="utf-8")


def test_a_score_is_plain_values_for_programs(mixed: Score) -> None:
    told = mixed.as_json()
    assert json.loads(json.dumps(told, allow_nan=False)) == told
    assert told["metrics"]["no gap: false alarms"]["cases"] == 2
    assert told["cases"] == {"no gap": 2, "single cause": 5, "outside the catalogue": 2, "several causes": 2}


def test_answers_are_scored_by_what_they_claim(mixed: Score) -> None:
    told = {(one["from"], one["to"]): (one["cases"], one["value"]) for one in mixed.as_json()["by_claim"]}
    assert sum(cases for cases, _ in told.values()) == 9
    assert told[0.5, 0.7] == (2, 0.0)
    assert "an answer that claims" in score_text(mixed)


def test_every_opening_of_the_keys_is_counted(tmp_path: Path, mixed: Score) -> None:
    assert mixed.openings == 1
    again = score_answers([(tmp_path / "answers", tmp_path / "keys")])
    assert again.openings == 2
    assert "The keys have been opened 2 times." in score_text(again)
    assert len((tmp_path / "keys" / "openings.txt").read_text().splitlines()) == 2


def test_cases_without_an_answer_are_named_and_answers_without_a_key_are_refused(
    tmp_path: Path, mixed: Score
) -> None:
    (tmp_path / "keys" / "late.toml").write_text(key([]))
    again = score_answers([(tmp_path / "answers", tmp_path / "keys")])
    assert again.unanswered == ("late",)
    assert "1 with a key have no answer" in score_text(again)
    (tmp_path / "others").mkdir()
    (tmp_path / "others" / "elsewhere.toml").write_text(key([]))
    with pytest.raises(InputError, match="no answer has a key"):
        score_answers([(tmp_path / "answers", tmp_path / "others")])


def test_several_sets_are_scored_as_one(tmp_path: Path, mixed: Score) -> None:
    other = tmp_path / "other"
    slip = answer(("gripper_slip",), {"gripper_slip": 0.95, "none": 0.05})
    scored(other, {"right": (key(["gripper_slip"]), slip)})
    together = score_answers([(folder / "answers", folder / "keys") for folder in (other, tmp_path)])
    assert values(together)["single cause: top-1"].value == pytest.approx(4 / 6)
    assert sum(together.cases.values()) == sum(mixed.cases.values()) + 1
    assert together.openings == 2
    for folder in (other, tmp_path):
        assert len((folder / "keys" / "openings.txt").read_text().splitlines()) == 2


def test_keys_may_lie_in_the_folders_of_the_cases(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "truth.toml").write_text(key(["prestretch"]))
    keys, _ = open_keys(tmp_path, "a test")
    assert {name: one.effects for name, one in keys.items()} == {
        "one": ("prestretch",),
        "two": ("prestretch",),
    }


@pytest.mark.parametrize(
    ("stated", "long_term_pa"), [("instantaneous", 0.7 * 26e3), ("long-term (relaxed)", 26e3)]
)
@pytest.mark.parametrize("prefix", ["", "viscoelasticity_"])
def test_of_tissue_that_relaxes_the_long_term_modulus_is_compared(
    tmp_path: Path, stated: str, long_term_pa: float, prefix: str
) -> None:
    told = [f'{prefix}youngs_modulus_is = "{stated}"', f"{prefix}relaxed_fraction = 0.3"]
    (tmp_path / "a.toml").write_text("\n".join([key(["viscoelasticity"]), "[parameters]", *told]))
    keys, _ = open_keys(tmp_path, "a test")
    assert keys["a"].youngs_modulus == pytest.approx(long_term_pa)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (
            key(["viscoelasticity"]) + '\n[parameters]\nyoungs_modulus_is = "instantaneous"',
            "relaxed_fraction is missing",
        ),
        ("effects = 3", "effects is no list"),
        ("effects = []", "youngs_modulus is missing"),
        (key(["inhomogeneity"], centre=[1]), "three numbers"),
        ("effects = [", "bad.toml"),
        (key(["force_bias"]) + '\nin_family = "distant"', "exact, near, far"),
        (key(["unknown"]) + '\nblock = "roof"', "block is roof"),
    ],
)
def test_a_key_that_cannot_be_read_is_complained_of(tmp_path: Path, text: str, complaint: str) -> None:
    (tmp_path / "bad.toml").write_text(text)
    with pytest.raises(InputError, match=complaint):
        open_keys(tmp_path, "a test")


def test_an_answer_that_is_no_diagnosis_is_complained_of(tmp_path: Path, mixed: Score) -> None:
    (tmp_path / "answers" / "right.json").write_text("{}")
    with pytest.raises(InputError, match=r"right\.json: is no diagnosis"):
        score_answers([(tmp_path / "answers", tmp_path / "keys")])


def test_cases_are_answered_without_their_keys_and_only_once(tmp_path: Path) -> None:
    cases = make_cases(tmp_path / "cases", {"a": "pull", "b": "twist", "c": "tangent"})
    heard: list[tuple[str, int, int]] = []
    done = answer_cases(stand_in, cases, tmp_path / "answers", progress=lambda *told: heard.append(told))
    assert (done.done, done.present) == (("a", "b"), ())
    assert done.failed == {"c": "the data do not determine the parameters"}
    assert heard[-1] == ("diagnosed c", 3, 3)
    assert json.loads((tmp_path / "answers" / "a.json").read_text())["verdict"] == ["inhomogeneity"]
    again = answer_cases(stand_in, cases, tmp_path / "answers")
    assert (again.done, again.present, list(again.failed)) == ((), ("a", "b"), ["c"])


def test_a_case_that_cannot_be_read_is_told_before_any_is_diagnosed(tmp_path: Path) -> None:
    cases = make_cases(tmp_path / "cases", {"a": "pull", "b": "twist"})
    (experiment,) = (cases / "b").glob("*/experiment.toml")
    experiment.write_text("format = 3", encoding="utf-8")
    with pytest.raises(InputError, match=r"experiment\.toml"):
        answer_cases(stand_in, cases, tmp_path / "answers")
    assert not (tmp_path / "answers").exists()


def test_several_cases_are_answered_at_a_time(tmp_path: Path) -> None:
    cases = make_cases(tmp_path / "cases", {"a": "pull", "b": "twist"})
    before = threading.active_count()
    done = answer_cases(stand_in, cases, tmp_path / "answers", workers=partial(worker_pool, 2))
    assert done.done == ("a", "b")
    assert threading.active_count() == before


def test_a_folder_without_cases_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no case"):
        answer_cases(stand_in, tmp_path, tmp_path / "answers")


def test_a_local_cause_without_a_place_counts_as_none_given(tmp_path: Path) -> None:
    told = as_json(replace(inclusion(), where=replace(inclusion().where, centre=None)))
    found = values(scored(tmp_path, {"a": (key(["inhomogeneity"], centre=[0.0, 0.0, 0.0]), told)}))
    assert found["local cause: a place is given"].value == 0.0
    assert found["place error, median"].count == 0
