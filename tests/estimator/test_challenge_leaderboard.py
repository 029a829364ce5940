"""The leaderboard: the worked score by hand, who stands where, and entries that are none of this set."""

import json
import math
import shutil
from pathlib import Path

import pytest

from estimator.blind.leaderboard.ranking import Leaderboard, ranked
from estimator.blind.leaderboard.telling import leaderboard_text, write_leaderboard
from estimator.blind.scoring.entries.entry import read_entry
from estimator.blind.scoring.entries.writing import write_entry
from estimator.blind.scoring.score import score_answers
from estimator.blind.scoring.telling import score_text
from estimator.blind.sealing.commitment import read_commitment
from estimator.blind.sealing.openings import read_openings
from estimator.blind.sealing.register import register
from estimator.errors import InputError

CONFORMANCE = Path(__file__).resolve().parents[2] / "examples" / "challenge" / "conformance"


@pytest.fixture
def example(tmp_path: Path) -> Path:
    """The conformance data, where openings may be counted."""
    return Path(shutil.copytree(CONFORMANCE, tmp_path / "example"))


def board_of(example: Path, *names: str) -> Leaderboard:
    return ranked([read_entry(example / "valid" / f"{name}.json") for name in names], example / "keys")


def test_the_worked_score_is_what_is_reckoned_by_hand(example: Path) -> None:
    (one,) = board_of(example, "whole").ranked
    found = {metric.name: (metric.figure.value, metric.figure.count) for metric in one.figures}
    logs = [math.log(p) for p in (0.9, 0.4, 0.8, 0.05, 0.5, 0.001, 0.9)]
    by_hand = {
        "log score": (sum(logs) / 7, 7),
        "top-1": (2 / 4, 4),
        "right group": (3 / 4, 4),
        "right block": (4 / 5, 5),
        "false alarms": (1 / 2, 2),
        "unknown recognised": (1.0, 1),
        "wrong with more than 0.9": (1 / 8, 8),
        "calibration error": ((0.2 + 0.95 + 0.7 + 0.6 + 0.5 + 0.2) / 7, 7),
        "several causes: all named": (1.0, 1),
        "several causes: at least one": (1.0, 1),
        "E, median error": (0.03, 5),
        "E in its interval": (3 / 5, 5),
        "half-width of E's interval, median": (400 / 15300, 5),
        "ν, median error": (0.015, 2),
        "ν in its interval": (1 / 2, 2),
        "time a case, median": (4.5, 8),
    }
    assert found.keys() == by_hand.keys()
    for name, (value, count) in by_hand.items():
        assert found[name] == (pytest.approx(value, abs=1e-9), count), name


def test_families_are_scored_apart(example: Path) -> None:
    (one,) = board_of(example, "whole").ranked
    found = {family: {m.name: m.figure for m in metrics} for family, metrics in one.by_family.items()}
    assert list(found) == ["exact", "near", "far"]
    assert [found[family]["top-1"].value for family in found] == [1.0, 0.0, 0.0]
    assert found["near"]["right group"].value == 1.0
    assert found["far"]["right block"].value == 0.5
    assert found["exact"]["log score"].value == pytest.approx((math.log(0.8) + math.log(0.5)) / 2)


def test_the_better_log_score_stands_first_and_the_keys_are_opened_once(example: Path) -> None:
    board = board_of(example, "minimal", "whole")
    assert [one.entry.name for one in board.ranked] == ["worked example", "minimal"]
    assert (board.openings.count, read_openings(example / "keys").count) == (1, 1)


def test_answers_registered_before_the_first_opening_are_told_from_others(example: Path) -> None:
    whole = read_entry(example / "valid" / "whole.json")
    register(example / "keys", whole.answers_hash, whole.name)
    first = board_of(example, "whole", "minimal")
    assert [one.standing for one in first.ranked] == [
        "registered before the keys were opened",
        "dated before, unregistered",
    ]
    told = json.loads((example / "valid" / "whole.json").read_text())
    told["answered"], told["entry"]["name"] = "2100-01-01T00:00:00Z", "late"
    (example / "valid" / "late.json").write_text(json.dumps(told))
    late = read_entry(example / "valid" / "late.json")
    register(example / "keys", late.answers_hash, late.name)
    # within the second in which the keys were opened first, registering counts as before
    (example / "keys" / "openings.txt").write_text("2026-11-28T12:00:01+00:00 a first time\n")
    assert [one.standing for one in board_of(example, "late").ranked] == ["after an opening"]


def test_the_score_of_a_file_of_answers_tells_how_it_stands(example: Path) -> None:
    found = score_answers([(example / "valid" / "whole.json", example / "keys")])
    assert found.standings == {"worked example": "dated before, unregistered"}
    assert "worked example: dated before, unregistered." in score_text(found)
    figures = {metric.name: metric.figure for metric in found.metrics}
    assert figures["single cause: top-1"].value == 0.5
    assert figures["rightly named: error of E before, median"].count == 0


def test_an_entry_to_another_set_is_not_scored_and_no_key_is_opened(example: Path) -> None:
    told = json.loads((example / "valid" / "whole.json").read_text())
    (example / "other.json").write_text(json.dumps({**told, "set": "0" * 64}))
    del told["answers"]["case03"]
    (example / "short.json").write_text(json.dumps(told))
    for name, complaint in (("other", "answers the set 000000000000"), ("short", "case03 is not both")):
        with pytest.raises(InputError, match=complaint):
            ranked([read_entry(example / f"{name}.json")], example / "keys")
        with pytest.raises(InputError, match=complaint):
            score_answers([(example / f"{name}.json", example / "keys")])
    assert read_openings(example / "keys").count == 0


def test_two_entries_of_one_name_are_refused(example: Path) -> None:
    with pytest.raises(InputError, match="two entries have this name"):
        board_of(example, "whole", "whole")


def test_what_an_entry_calls_itself_makes_no_markup(example: Path) -> None:
    told = json.loads((example / "valid" / "whole.json").read_text())
    told["entry"]["name"] = "<b>best</b> | [here](http://x.example)"
    (example / "valid" / "loud.json").write_text(json.dumps(told))
    board = board_of(example, "loud", "minimal")
    for name in ("board.md", "board.html"):
        write_leaderboard(board, example / name)
        assert "<b>" not in (example / name).read_text()
    assert "[here](" not in (example / "board.md").read_text()
    table = [line for line in (example / "board.md").read_text().splitlines() if line.startswith("| 1 |")]
    assert table[0].replace("\\|", "").count("|") == table[0].count("|") - table[0].count("\\|")
    assert "best" in leaderboard_text(board)


def test_answers_written_as_an_entry_are_read_back(example: Path) -> None:
    before = read_entry(example / "valid" / "whole.json").answers
    published = read_commitment(example / "cases")
    about = {"name": "again", "authors": ["nobody"], "method": "copied"}
    write_entry(before, published, about, example / "again.json")
    after = read_entry(example / "again.json")
    assert after.set_hash == published.set_hash
    for name, answer in before.items():
        found = after.answers[name]
        assert (found.verdict, found.block, found.centre) == (answer.verdict, answer.block, answer.centre)
        assert found.probabilities == pytest.approx(answer.probabilities)
        assert found.youngs_modulus == answer.youngs_modulus
