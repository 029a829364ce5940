"""The benchmarks of the diagnosis: what they move, what they measure, and what they make of answers."""

import argparse
import doctest
import math
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path

import pytest

from benchmarks import calibration
from benchmarks.calibration import FACTORS, calibrated_numbers, standing_of, with_measured, with_number_times
from benchmarks.diagnosis import Cost, measured, ratios
from estimator.blind.scoring.answers import Answer
from estimator.blind.scoring.keys import Key
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.errors import InputError

CALIBRATION = Path(__file__).resolve().parents[2] / "estimator" / "diagnosis" / "calibration.toml"
NAMES = [number.name for number in calibrated_numbers()]


def numbers_of(settings: DiagnosisSettings) -> dict[str, float | tuple[float, ...]]:
    return {number.name: number.value for number in settings.numbers()}


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("factor", FACTORS.values())
def test_one_number_is_moved_and_no_other(name: str, factor: float) -> None:
    before, after = numbers_of(DiagnosisSettings()), numbers_of(with_number_times(name, factor))
    assert {one for one in before if before[one] != after[one]} == {name}


def test_a_number_that_is_not_calibrated_is_refused_with_those_that_are() -> None:
    with pytest.raises(
        InputError, match=r"search\.close: no calibrated number; there are noise\.outlier_scatter"
    ):
        calibrated_numbers(["search.close"])


def answer(verdict: Sequence[str], **probabilities: float) -> Answer:
    return Answer(tuple(verdict), probabilities, seconds=1.0, credible_set=())


def key(*effects: str) -> Key:
    return Key(effects, 1e4, 0.45, None, "", ())


def test_the_standing_counts_whole_verdicts_and_the_probability_of_the_truth() -> None:
    answers = {
        "clean": answer([], none=0.8, force_gain=0.2),
        "named": answer(["force_gain"], force_gain=0.5, none=0.5),
        "impossible": answer(["slip"], slip=1.0),
        "two": answer(["slip", "force_gain"], slip=0.7),
        "half of two": answer(["slip"], slip=0.7),
    }
    keys = {
        "clean": key(),
        "named": key("force_gain"),
        "impossible": key("prestretch"),
        "two": key("force_gain", "slip"),
        "half of two": key("force_gain", "slip"),
        "not answered": key(),
    }
    found = standing_of(answers, keys)
    assert (found.right, found.cases) == (3, 5)
    assert found.log_score == pytest.approx((math.log(0.8) + math.log(0.5) + math.log(1e-3)) / 3)


def test_what_was_measured_is_written_where_it_belongs() -> None:
    before = CALIBRATION.read_text(encoding="utf-8")
    after = tomllib.loads(with_measured(before, {NAMES[-1]: {"half": "a", "twice": "b"}}))
    expected = tomllib.loads(before)
    expected[NAMES[-1]] |= {"half": "a", "twice": "b"}
    assert after == expected


def test_a_number_without_a_row_is_told() -> None:
    with pytest.raises(InputError, match=r'no row \["search.none"\]'):
        with_measured("scored = [1]\n", {"search.none": {"half": "a"}})


def test_the_example_of_the_moved_number_runs() -> None:
    assert doctest.testmod(calibration).failed == 0


def test_a_command_is_measured_with_all_that_it_starts(tmp_path: Path) -> None:
    child = (
        "import time\nblock = bytearray(60_000_000)\nend = time.process_time() + 0.6\n"
        "while time.process_time() < end: pass"
    )
    parent = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}]); print('done')"
    cost, printed = measured([sys.executable, "-c", parent], tmp_path)
    assert printed == "done\n"
    assert 0.6 <= cost.cpu_s < 10.0
    assert cost.wall_s > 0.5
    if sys.platform == "linux":
        assert cost.memory_mb > 60.0


def test_a_command_that_fails_is_told_with_what_it_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="ended with 3: no such case"):
        measured(
            [sys.executable, "-c", "import sys; sys.stderr.write('no such case'); sys.exit(3)"], tmp_path
        )


def test_ratios_are_of_this_build_to_the_other() -> None:
    assert ratios(Cost(1, 2, 3), Cost(4, 4, 4)) == "processors 0.50, wall 0.25, memory 0.75"


def test_the_options_of_both_are_understood() -> None:
    parser = argparse.ArgumentParser()
    calibration.add_arguments(parser)
    assert parser.parse_args(["cases", "keys", "results", "--only", "search.kept"]).only == ["search.kept"]
