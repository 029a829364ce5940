"""What is told of a diagnosis: as an object for programs, in a few lines, and on a page for a person."""

import json
import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic_diagnoses import DEVIATION, inclusion, no_gap, trace, two_causes, unexplained

from estimator.diagnosis.conclusions.as_json import as_json
from estimator.diagnosis.result import Diagnosis, Gap, Quantity
from estimator.report.channels import CHANNELS
from estimator.report.diagnosis.findings import gap_sentence, summary_text
from estimator.report.diagnosis.map_plot import arrow_factor
from estimator.report.diagnosis.quantities import percent, quantity_text
from estimator.report.diagnosis.residuals import farthest_fiducials_mm, residual_map, stretches
from estimator.report.diagnosis.writing import write_report


def written(diagnosis: Diagnosis, folder: Path) -> str:
    file = folder / "reports" / "diagnosis.html"
    write_report(diagnosis, file, title="Diagnosis of <P07>", provenance={"case": "cases/<P07>"})
    return file.read_text(encoding="utf-8")


def words(page: str) -> str:
    """What a reader reads: the text of the page without its figures."""
    body = ET.fromstring(page).find("body")
    assert body is not None
    for element in body.iter("figure"):
        for drawing in element.findall("svg"):
            element.remove(drawing)
    return " ".join("".join(body.itertext()).split())


def drawn(page: str) -> list[str]:
    """The texts in the figures."""
    return ["".join(text.itertext()) for text in ET.fromstring(page).iter("text")]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> str:
    return written(inclusion(), tmp_path_factory.mktemp("report"))


def test_the_object_for_programs_has_the_agreed_shape() -> None:
    told = as_json(inclusion())
    assert list(told) == [
        "verdict",
        "probabilities",
        "credible_set",
        "effects",
        "gap",
        "where",
        "material",
        "next_experiment",
        "seconds",
    ]
    assert told["verdict"] == ["inhomogeneity"]
    assert list(told["effects"]["inhomogeneity"]) == [
        "state",
        "parameters",
        "chi2_drop",
        "closure_held_out",
        "form",
        "alone",
    ]
    assert told["effects"]["inhomogeneity"]["parameters"]["radius"] == {
        "value": 0.0161,
        "std": 0.0009,
        "unit": "m",
    }
    assert list(told["gap"]) == [
        "before",
        "after",
        "floor",
        "closure_held_out",
        "by_channel",
        "by_experiment",
        "at_most",
    ]
    assert told["gap"]["at_most"]["fiducials"] == {"value": 7e-6, "unit": "m"}
    assert told["gap"]["by_channel"]["torque"]["closure_held_out"] == -0.1
    assert list(told["where"]) == ["block", "channels", "steps", "blocks", "centre", "radius"]
    assert told["where"]["centre"] == [-0.0113, 0.0152, 0.0]
    assert told["material"]["after"]["poisson_ratio"] == {"value": 0.482, "std": 0.003}
    assert told["next_experiment"][0]["separates"] == ["inhomogeneity", "modulus_gradient"]


def test_what_is_not_known_is_null_in_the_object_for_programs() -> None:
    told = as_json(no_gap())
    assert told["verdict"] == []
    assert told["where"]["centre"] is None
    assert told["gap"]["closure_held_out"] is None
    assert json.loads(json.dumps(told, allow_nan=False)) == told


def test_the_page_asks_for_nothing_from_outside_and_escapes_what_it_is_told(page: str) -> None:
    assert not re.search(r"https?:|<script|<link|<iframe|@import", page)
    assert ET.fromstring(page).findtext("head/title") == "Diagnosis of <P07>"
    assert "cases/<P07>" in words(page)


def test_every_reference_within_the_page_has_its_target(page: str) -> None:
    targets = set(re.findall(r'id="([^"]*)"', page))
    assert set(re.findall(r'(?:href="|url\()#([^")]*)', page)) <= targets


def test_the_figures_follow_the_theme_of_the_reader(page: str) -> None:
    drawings = "".join(re.findall(r"<svg.*?</svg>", page, flags=re.DOTALL))
    assert "var(--predicted)" in drawings
    assert "#d55e00" not in drawings


def test_the_page_begins_with_the_verdict_its_size_and_how_far_the_gap_closes(page: str) -> None:
    assert words(page).startswith(
        "Diagnosis of <P07> Inhomogeneity (93 %) causes the gap. Inhomogeneity: a region of the tissue is stiffer "
        "or softer than the rest; log stiffness ratio 0.980 ± 0.060, centre x -11.3 ± 1.2 mm, centre y "
        "15.2 ± 1.8 mm, radius 16.10 ± 0.90 mm. Gap on experiments left out of the fit: 4.31 σ before, 1.20 σ "
        "after, 1.00 σ is noise alone; 94 % of it closes."
    )


def test_numbers_in_figures_keep_their_digits(page: str) -> None:
    assert {"0.431", "0.482", "24.1", "26.05"} <= set(drawn(page))


def test_the_page_shows_ranking_place_material_and_advice(page: str) -> None:
    text = words(page)
    for stated in (
        "x = -11.3, y = 15.2, z = 0.0 mm (± 1.2, 1.8, 1.0), its radius 16.1 mm",
        "ν 0.4310 ± 0.0040 -> 0.4820 ± 0.0030",
        "separates inhomogeneity from modulus gradient, now 3.40 σ apart, then 9.80 σ",
        "no experiment repeats a smaller one",
    ):
        assert stated in text
    for shown in ("interior 94 %", "anchor 2 %", "93 %", "modulus gradient", "twist/return hold"):
        assert shown in drawn(page)


@pytest.mark.parametrize(
    ("gap", "told"),
    [
        (Gap(1.01, 0.985, 0.99, 1.25), "all of it closes (the gap stands only 1.02 × above the noise)."),
        (Gap(1.01, 0.995, 0.99, 0.75), "75 % of it closes (the gap stands only 1.02 × above the noise)."),
        (Gap(5.0, 0.985, 0.99, 1.0012), "all of it closes."),
        (Gap(5.0, 0.985, 0.99, 1.0012, 0.031), "; 100 ± 3 % of it closes."),
        (Gap(5.0, 1.23, 0.99, 0.94, 0.031), "; 94 ± 3 % of it closes."),
    ],
)
def test_never_more_than_all_of_a_gap_closes_and_a_slight_one_is_called_so(gap: Gap, told: str) -> None:
    assert gap_sentence(gap).endswith(told)


def test_a_gap_that_widens_is_shown_and_not_hidden(page: str) -> None:
    assert "widens 10 %" in drawn(page)
    assert "widens 10 %" in words(page)


def test_the_table_of_effects_states_what_would_have_shown(page: str) -> None:
    rows = ["|".join("".join(cell.itertext()) for cell in row) for row in ET.fromstring(page).iter("tr")]
    assert "modulus gradient|inhomogeneity|absent|5 %|1200|41 %|amount 0.0010 ± 0.0020|amount 0.006" in rows
    assert "stress softening|material|cannot tell|0 %|0|–|amount 0.0010 ± 0.0020|–" in rows


def test_a_report_of_the_same_diagnosis_is_the_same(page: str, tmp_path: Path) -> None:
    assert written(inclusion(), tmp_path) == page


def test_a_case_without_a_gap_says_so() -> None:
    lines = summary_text(no_gap()).splitlines()
    assert lines[0] == (
        "No gap: the baseline explains the data within the sensors' noise "
        "(probability 96 %; else one is too small to show). "
        "One that does not show is below 7 µm of the beads, 5 mN of force and 0.12 mN·m of torque (95 %)."
    )
    assert "  Stress softening would not show: depth below 0.4 1." in lines


def test_what_noise_does_not_feign_though_there_is_no_gap_is_put_down_to_the_model() -> None:
    slight = "But that one is so slight that a small error of the model could feign it too."
    assert slight in summary_text(replace(no_gap(), chance=0.01))
    assert slight not in summary_text(replace(no_gap(), chance=0.3))
    assert slight not in summary_text(replace(unexplained(), chance=0.01))


def test_a_case_that_nothing_explains_says_so_and_in_which_block_to_look() -> None:
    unknown = unexplained()
    cameras = replace(unknown.where, blocks={"interior": 0.12, "vision": 0.84, "anchor": 0.04})
    assert summary_text(replace(unknown, where=cameras)).startswith(
        "A gap stands out of the noise, and nothing in the catalogue explains it (probability 91 %). "
        "Where to look: the cameras (84 %), then in the tissue (12 %).\n"
    )
    assert as_json(replace(unknown, where=cameras))["where"]["block"] == "vision"
    assert as_json(no_gap())["where"]["block"] is None


def test_an_answer_that_another_one_nearly_equals_is_told_with_that() -> None:
    close = {"inhomogeneity": 0.43, "none": 0.4, "unknown": 0.1}
    assert summary_text(replace(inclusion(), probabilities=close)).startswith(
        "Inhomogeneity (43 %) is the likeliest cause of a gap; next is no gap beyond the noise (40 %).\n"
    )
    none = {"none": 0.45, "camera_scale": 0.35, "unknown": 0.1}
    first, *_ = summary_text(replace(no_gap(), probabilities=none)).splitlines()
    assert "(probability 45 %; camera scale (35 %) is next). One that does not show is below 7 µm" in first


def test_a_cause_that_is_likelier_than_none_and_yet_not_named_is_told_of() -> None:
    doubtful = {"camera_scale": 0.6, "none": 0.3, "unknown": 0.1}
    assert summary_text(replace(no_gap(), probabilities=doubtful)).startswith(
        "Nothing is sure: camera scale (60 %) may cause a gap, or there is no gap beyond the noise (30 %).\n"
    )


def test_two_causes_and_a_remainder_are_one_sentence() -> None:
    lines = summary_text(two_causes()).splitlines()
    assert lines[0] == (
        "Viscoelasticity (97 %) together with anchor compliance causes the gap, but something more remains "
        "unexplained."
    )
    assert lines[2].endswith("compliance 8.40e-09 ± 6.0e-10 m/Pa.")
    ranked = lines[lines.index("Ranking:") + 1 :]
    assert ranked[0].startswith("    97 %  viscoelasticity")
    assert ranked[1].startswith("  beside  anchor compliance")


def test_something_recognised_outside_the_catalogue_that_leads_is_told_first() -> None:
    causes = two_causes()
    torn = replace(causes.effects["viscoelasticity"], label="unknown", words="The tissue is torn at a place.")
    found = replace(
        causes,
        verdict=("unknown", "anchor_compliance"),
        probabilities={"unknown": 0.97, "anchor_compliance": 0.03},
        effects={**causes.effects, "unknown": torn},
    )
    first, *_ = summary_text(found).splitlines()
    assert first == (
        "Something outside the catalogue (97 %) causes the gap, with anchor compliance beside it. "
        "The tissue is torn at a place."
    )


@pytest.mark.parametrize("made", [no_gap, unexplained, two_causes])
def test_every_kind_of_verdict_has_a_page(made: type, tmp_path: Path) -> None:
    page = written(made(), tmp_path)
    assert "The cause is local" not in words(page)
    assert len(page) < 2e6


def test_a_closure_below_zero_is_told_as_such() -> None:
    worse = replace(inclusion(), gap=Gap(2.0, 2.3, 1.0, -0.3))
    assert "adding the causes widens it by 30 %" in summary_text(worse)


def test_a_case_without_fiducials_is_reported_on_its_wrench(tmp_path: Path) -> None:
    seen = trace("pull", 1, None, 0.5)
    rows = len(seen.experiment.time)
    bare = replace(seen.experiment, fiducials_rest=np.empty((0, 3)), fiducials=np.empty((rows, 0, 3)))
    wrench_only = replace(
        seen,
        experiment=bare,
        before=seen.before[:, :6],
        after=seen.after[:, :6],
        deviation=DEVIATION[:6],
    )
    text = words(written(replace(unexplained(), traces=(wrench_only,)), tmp_path))
    assert "1. pull" in text
    assert "from above" not in text


def test_measurements_that_are_missing_leave_gaps(tmp_path: Path) -> None:
    seen = trace("pull", 1, (0.0, 0.0), 0.5)
    wrench, fiducials = seen.experiment.wrench.copy(), seen.experiment.fiducials.copy()
    wrench[:, 4] = np.nan
    fiducials[:, 1] = np.nan
    holed = replace(seen, experiment=replace(seen.experiment, wrench=wrench, fiducials=fiducials))
    found = residual_map(holed, holed.before)
    assert np.isnan(found[CHANNELS.index("ty")]).all()
    assert np.isfinite(np.delete(found, CHANNELS.index("ty"), axis=0)).all()
    assert "1. pull" in words(written(replace(unexplained(), traces=(holed,)), tmp_path))


def test_residuals_are_one_sigma_where_the_model_is_right_and_grow_along_the_pull_where_not() -> None:
    seen = trace("pull", 1, None, 1.0)
    after = residual_map(seen, seen.after)
    assert np.sqrt(np.mean(after**2)) == pytest.approx(1.0, abs=0.1)
    fx = residual_map(seen, seen.before)[0]
    parts = stretches(seen.experiment)
    assert [(part.step, part.phase) for part in parts[:3]] == [(0, "hold"), (1, "ramp"), (1, "hold")]
    farthest = next(n for n, part in enumerate(parts) if (part.step, part.phase) == (8, "hold"))
    assert fx[farthest] == pytest.approx(1.0 / 0.02, rel=0.1)
    assert fx[0] < 3.0


def test_both_maps_exaggerate_by_the_same_round_factor() -> None:
    seen = trace("pull", 1, (0.0, 0.0), 0.7)
    swapped = replace(seen, before=seen.after, after=seen.before)
    factor = arrow_factor(seen)
    assert factor == arrow_factor(swapped)
    assert factor in {1.0, 2.0, 5.0, 10.0, 20.0, 50.0}
    longest_mm = np.linalg.norm(farthest_fiducials_mm(seen, seen.before)[1], axis=1).max()
    assert 7.0 < factor * longest_mm <= 18.0


@pytest.mark.parametrize(
    ("quantity", "text"),
    [
        (Quantity(0.0031, 0.00042, "m"), "3.10 ± 0.42 mm"),
        (Quantity(0.5, 0.0, "1"), "0.5"),
        (Quantity(math.radians(2), math.radians(0.1), "rad"), "2.00 ± 0.10 °"),
        (Quantity(24_123.0, 150.0, "Pa"), "24.12 ± 0.15 kPa"),
        (Quantity(0.3, math.nan, "s"), "0.3 s"),
        (Quantity(math.nan, 1.0, "s"), "–"),
    ],
)
def test_quantities_are_told_in_handy_units_with_the_digits_that_are_known(
    quantity: Quantity, text: str
) -> None:
    assert quantity_text(quantity) == text


def test_what_is_not_quite_certain_is_not_called_so() -> None:
    assert [percent(p) for p in (0.0, 0.001, 0.5, 0.9999, 1.0)] == ["0 %", "< 1 %", "50 %", "> 99 %", "100 %"]
