"""Opening keys: which answers they belong to, that each opening is counted, and keys that cannot be read."""

from pathlib import Path

import pytest
from blind_scores import answer, key, mixed_score, scored, values

from estimator.blind.scoring.keys import open_keys
from estimator.blind.scoring.score import Score, score_answers
from estimator.blind.scoring.telling import score_text
from estimator.errors import InputError


@pytest.fixture
def mixed(tmp_path: Path) -> Score:
    return mixed_score(tmp_path)


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
