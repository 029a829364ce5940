"""Every number of the diagnosis says what it is, and the calibrated ones where they come from."""

import doctest
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from estimator.diagnosis import settings as module
from estimator.diagnosis.declared_numbers import KINDS
from estimator.diagnosis.settings import DiagnosisSettings
from estimator.diagnosis.settings_page import origins, page
from estimator.errors import InputError

SETTINGS = DiagnosisSettings()
CALIBRATION = tomllib.loads(Path(module.__file__).with_name("calibration.toml").read_text(encoding="utf-8"))
ROWS = origins()
PAGE = Path(__file__).resolve().parents[2] / "docs" / "method" / "settings.md"


def test_every_number_has_a_unit_a_kind_and_a_reason() -> None:
    for number in SETTINGS.numbers():
        assert number.unit, number.name
        assert number.kind in KINDS, number.name
        assert len(number.reason) > 5, number.name


def test_every_calibrated_number_tells_where_it_comes_from_and_no_other_does() -> None:
    calibrated = {number.name for number in SETTINGS.numbers() if number.kind == "calibrated"}
    assert calibrated == ROWS.keys()


@pytest.mark.parametrize("name", sorted(ROWS))
def test_an_origin_is_whole(name: str) -> None:
    row = ROWS[name]
    assert row.keys() - {"since_scored"} == {"commit", "opened_until", "statistic", "half", "twice"}
    assert len(row["commit"]) == 7
    assert row["statistic"]


def test_no_seed_that_is_scored_served_to_calibrate() -> None:
    first = min(CALIBRATION["scored"])
    late = {name for name, row in ROWS.items() if row["opened_until"] >= first}
    assert late == {name for name, row in ROWS.items() if row.get("since_scored")}


@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf")])
def test_a_number_that_cannot_be_is_refused_by_its_name(value: float) -> None:
    with pytest.raises(InputError, match=r"search\.close is"):
        replace(SETTINGS, search=replace(SETTINGS.search, close=value))


def test_a_grid_without_points_is_refused() -> None:
    with pytest.raises(InputError, match=r"evidence\.sizes is \(\)"):
        replace(SETTINGS, evidence=replace(SETTINGS.evidence, sizes=()))


def test_a_race_needs_as_many_shares_as_rounds() -> None:
    with pytest.raises(InputError, match="round_points, round_shares and round_forms"):
        replace(SETTINGS, search=replace(SETTINGS.search, round_points=(2, 5, 9)))


def test_the_page_of_the_numbers_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == page()


def test_their_example_runs() -> None:
    assert doctest.testmod(module).failed == 0
