"""What the terminal and the page say of an uncertainty budget."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from synthetic_estimates import estimate_of, made_up_budget, pull_fit
from test_report_estimation import words, written

from estimator.report.estimation.budget import (
    budget_sentences,
    budget_text,
    device_head,
    device_rows,
    source_head,
    source_rows,
)
from estimator.report.estimation.budget_plot import draw_budget


def test_a_source_is_told_with_size_sensitivity_share_and_origin() -> None:
    budget = made_up_budget()
    rows = {row[0]: dict(zip(source_head(budget), row, strict=True)) for row in source_rows(budget)}
    gain = rows["force gain"]
    assert (gain["u(x)"], gain["type"]) == ("1 %", "B")
    assert (gain["|c(E)|, kPa/unit"], gain["u(E), kPa"]) == ("0.2", "0.2")
    assert (gain["of"], gain["from"]) == ("force sensor", "assumed: a guess")
    beads = rows["noise of the beads *"]
    assert (beads["u(x)"], beads["type"], beads["u(ν)"]) == ("50 µm", "A", "0.002")
    assert rows["mass beyond the force sensor"]["u(E), kPa"] == "0"


def test_the_device_to_begin_with_is_another_for_each_parameter() -> None:
    modulus, first, ratio, then = budget_sentences(made_up_budget())
    assert modulus.startswith("E: combined standard uncertainty 0.2 kPa, of which the fit knows 0.006 kPa; ")
    assert "expanded uncertainty 0.392 kPa (k = 1.96, about 95 %)." in modulus
    assert first.startswith("To know E better, begin with the force sensor: it makes 100 % of the variance")
    assert ratio.startswith("ν: combined standard uncertainty 0.002, of which the fit knows 0.002; ")
    assert then == (
        "To know ν better, begin with the cameras: it makes 100 % of the variance, and half as uncertain it would "
        "leave 0.001."
    )


def test_what_could_not_be_evaluated_is_told() -> None:
    *_, last = budget_sentences(replace(made_up_budget(), left_out=("thickness of the phantom",)))
    assert last.startswith("Not in it: thickness of the phantom; the motion has no equilibrium")


def test_the_terminal_names_small_sources_together_and_aligns_the_others() -> None:
    lines = budget_text(made_up_budget()).splitlines()
    assert "Below 0.05 % of every variance: mass beyond the force sensor." in lines
    head = next(line for line in lines if line.startswith("source"))
    gain = next(line for line in lines if line.startswith("force gain"))
    end = head.index("u(E), kPa") + len("u(E), kPa")
    assert gain[:end].endswith(" 0.2")
    assert gain[head.index("from") :] == "assumed: a guess"


def test_the_page_has_tables_and_a_figure_of_it(tmp_path: Path) -> None:
    page = written(replace(estimate_of(pull_fit()), budget=made_up_budget()), tmp_path)
    text = words(page)
    for part in (
        "Uncertainty budget",
        "Which device to improve",
        "Sources of uncertainty",
        "begin with the cameras",
    ):
        assert part in text
    assert "share in the variance of E, %" in page


def test_without_a_budget_there_is_no_such_section(tmp_path: Path) -> None:
    assert "Uncertainty budget" not in words(written(estimate_of(pull_fit()), tmp_path))


def test_the_figure_has_a_bar_for_every_source_that_matters() -> None:
    sheet = Figure(figsize=(11.4, 3.0))
    draw_budget(sheet, made_up_budget())
    modulus, ratio = sheet.axes
    assert [bar.get_width() for bar in modulus.patches] == pytest.approx([0.09, 99.91], abs=0.01)
    assert [bar.get_width() for bar in ratio.patches] == pytest.approx([100.0, 0.0])


def test_the_numbers_of_an_estimate_hold_its_budget() -> None:
    found = replace(estimate_of(pull_fit()), budget=made_up_budget())
    told = json.loads(json.dumps(found.as_json()))["budget"]
    assert told["lines"][0]["source"]["origin"] == {"evaluation": "A", "words": "scatter"}
    assert told["combined"]["youngs_modulus"] == pytest.approx(200.09, abs=0.01)
    assert told["expanded"]["poisson_ratio"] == pytest.approx(1.96 * 0.002, rel=1e-3)
    assert [one["device"] for one in told["devices"]] == [row[0] for row in device_rows(made_up_budget())]
    assert len(device_head(made_up_budget())) == 7
    assert estimate_of(pull_fit()).as_json()["budget"] is None
