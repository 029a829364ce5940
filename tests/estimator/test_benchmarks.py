"""The benchmarks of the diagnosis: what they move, what they measure, and what they make of answers."""

import argparse
import doctest
import json
import math
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path

import pytest

from benchmarks import calibration
from benchmarks.calibration import FACTORS, calibrated_numbers, standing_of, with_measured, with_number_times
from benchmarks.diagnosis import Build, Cost, agreement, diagnosed, in_turn, measured, ratios
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


def stand_in(folder: Path, name: str | None, modulus: float) -> Build:
    """A build whose diagnosis takes no time, notes each case that it is given, and fails for one called broken."""
    package = folder / str(name) / "daq"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    material = {
        "youngs_modulus": {"value": modulus, "std": 100.0},
        "poisson_ratio": {"value": 0.4, "std": 0.0},
    }
    told = {
        "verdict": ["force_drift"],
        "probabilities": {"force_drift": 1.0},
        "credible_set": ["force_drift"],
        "where": {"blocks": {"force": 1.0}, "centre": None},
        "gap": {"closure_held_out": None},
        "material": {"before": material, "after": material},
        "seconds": 1.0,
    }
    (package / "cli.py").write_text(
        "import pathlib, sys\n"
        "case = pathlib.Path(sys.argv[2])\n"
        "if case.name == 'broken': sys.exit('no case')\n"
        "with pathlib.Path('given').open('a') as file: file.write(case.name + ' ')\n"
        f"print({json.dumps(json.dumps(told))})\n",
        encoding="utf-8",
    )
    return Build(name, Path(sys.executable), package.parent)


def test_two_builds_diagnose_in_turn_and_go_on_where_they_stopped(tmp_path: Path) -> None:
    builds = stand_in(tmp_path, "this", 10_010.0), stand_in(tmp_path, "other", 10_000.0)
    results = tmp_path / "results"
    first = list(in_turn([Path("a"), Path("b")], builds, results))
    again = list(in_turn([Path("b"), Path("c")], builds, results))
    assert [(build.tree / "given").read_text() for build in builds] == ["a b c "] * 2
    assert first[1].startswith("a: ")
    assert first[1].endswith("the same verdict, E 0.100 and nu 0.000 deviations apart")
    assert first[2] == again[1]
    assert again[-1].startswith("all: processors ")


def test_a_build_with_changes_that_are_in_no_commit_diagnoses_anew(tmp_path: Path) -> None:
    build = stand_in(tmp_path, None, 1e4)
    for _ in range(2):
        diagnosed(build, tmp_path / "a", tmp_path / "results")
    assert (build.tree / "given").read_text() == "a a "


def test_a_case_that_fails_is_told_and_the_others_are_diagnosed(tmp_path: Path) -> None:
    builds = stand_in(tmp_path, "this", 1e4), stand_in(tmp_path, "other", 1e4)
    told = in_turn([Path("broken"), Path("a")], builds, tmp_path / "results")
    seen = [next(told) for _ in range(4)]
    assert "no case" in seen[1]
    assert seen[2].startswith("a: ")
    with pytest.raises(InputError, match="broken: not diagnosed"):
        next(told)


def test_another_verdict_is_told() -> None:
    assert agreement(answer(["slip"]), answer([])).startswith("ANOTHER VERDICT")


def test_the_options_of_both_are_understood() -> None:
    parser = argparse.ArgumentParser()
    calibration.add_arguments(parser)
    assert parser.parse_args(["cases", "keys", "results", "--only", "search.kept"]).only == ["search.kept"]
