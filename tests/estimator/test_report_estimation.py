"""The report of an estimation: what the page and the terminal say, and that the page needs nothing but itself."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from synthetic_estimates import PULL_M, SENSOR, TRUTH, at_its_end, block, estimate_of, pull_fit, stretched

from estimator.fem.discretisation.elements import ElementKind
from estimator.fit.result import Estimate, ParameterEstimate
from estimator.report.channels import channel_residuals, worst_fiducial
from estimator.report.drawing.stretch import largest_stretch
from estimator.report.estimation.body_plot import draw_body
from estimator.report.estimation.findings import Truth, caveats, summary_text
from estimator.report.estimation.writing import write_report
from estimator.report.page import figure


def written(estimate: Estimate, folder: Path, truth: Truth | None = TRUTH) -> str:
    page = folder / "reports" / "estimate.html"
    write_report(
        estimate,
        page,
        title="Bar <1> & co",
        truth=truth,
        provenance={"input": "runs/<1>", "law": "Neo-Hookean"},
    )
    return page.read_text(encoding="utf-8")


def words(page: str) -> str:
    """What a reader reads: the text of the page without its figures."""
    body = ET.fromstring(page).find("body")
    assert body is not None
    for element in body.iter("figure"):
        for drawing in element.findall("svg"):
            element.remove(drawing)
    return " ".join("".join(body.itertext()).split())


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> str:
    return written(estimate_of(pull_fit()), tmp_path_factory.mktemp("report"))


def test_the_page_asks_for_nothing_from_outside(page: str) -> None:
    assert not re.search(r"https?:|<script|<link|<iframe|@import", page)
    references = re.findall(r'(?:href|src)="([^"]*)"|url\(([^)]*)\)', page)
    assert references
    assert all((a or b).startswith(("#", "data:")) for a, b in references)


def test_every_reference_within_the_page_has_its_target(page: str) -> None:
    targets = set(re.findall(r'id="([^"]*)"', page))
    assert set(re.findall(r'(?:href="|url\()#([^")]*)', page)) <= targets


def test_the_page_is_well_formed_and_escapes_what_it_is_told(page: str) -> None:
    root = ET.fromstring(page)
    assert root.findtext("head/title") == "Bar <1> & co"
    text = words(page)
    assert "runs/<1>" in text
    assert "bar <1>" in text


def test_the_page_begins_with_the_values_their_intervals_and_the_verdict(page: str) -> None:
    text = words(page)
    assert text.startswith(
        "Bar <1> & co E = 20.00 kPa (95 %: 19.77 to 20.24), ν = 0.4512 (95 %: 0.4469 to 0.4553)."
    )
    assert "explains the data within the sensors' noise: the residuals are 1.02 times" in text
    assert "Truth: E = 20.1 kPa (estimate off by -0.5 %, within the interval)" in text
    assert "ν = 0.46 (off by -0.0088, outside the interval)" in text


def test_the_page_states_mesh_effort_and_residuals(page: str) -> None:
    text = words(page)
    for stated in ("8 elements hex27, 135 nodes", "states solved57", "12.3 s", "-0.31", "Neo-Hookean"):
        assert stated in text
    fx = next(c for c in channel_residuals(pull_fit()) if c.name == "fx")
    assert f"fx{fx.rms:.3g} N{fx.rms_sigma:.2f}{fx.scatter_sigma:.2f}" in text


def test_the_figures_follow_the_theme_of_the_reader(page: str) -> None:
    drawings = "".join(re.findall(r"<svg.*?</svg>", page, flags=re.DOTALL))
    assert "var(--measured)" in drawings
    assert "#0072b2" not in drawings
    assert "prefers-color-scheme: dark" in page


def test_a_report_of_the_same_estimate_is_the_same(page: str, tmp_path: Path) -> None:
    assert written(estimate_of(pull_fit()), tmp_path) == page


def test_three_experiments_have_a_section_each_and_the_page_stays_small(tmp_path: Path) -> None:
    names = ("pull", "twist", "tangent")
    page = written(estimate_of(*(pull_fit(name, seed=n) for n, name in enumerate(names))), tmp_path)
    sections = [heading.text for heading in ET.fromstring(page).iter("h2")]
    assert sections[:3] == ["1. pull", "2. twist", "3. tangent"]
    assert len(page) < 3e6
    boxes = [box.get("id") for box in ET.fromstring(page).iter("input")]
    assert len(set(boxes)) == 3


def test_many_rows_do_not_swell_the_page(tmp_path: Path) -> None:
    assert len(written(estimate_of(pull_fit(rows=2000)), tmp_path)) < 1.5e6


def test_the_truth_is_absent_where_it_is_unknown(tmp_path: Path) -> None:
    assert "Truth" not in words(written(estimate_of(pull_fit()), tmp_path, truth=None))


def test_measurements_that_are_missing_leave_gaps(tmp_path: Path) -> None:
    fit = pull_fit()
    wrench, fiducials = fit.experiment.wrench.copy(), fit.experiment.fiducials.copy()
    wrench[3:6] = np.nan
    wrench[:, 4] = np.nan
    fiducials[:, 1] = np.nan
    fiducials[::3, 2, 2] = np.nan
    fit = replace(fit, experiment=replace(fit.experiment, wrench=wrench, fiducials=fiducials))
    by_name = {channel.name: channel for channel in channel_residuals(fit)}
    assert (by_name["fx"].count, by_name["ty"].count, by_name["fiducials x"].count) == (37, 0, 80)
    assert "ty– mN·m––" in words(written(estimate_of(fit), tmp_path))


def test_an_experiment_without_any_fiducial_is_reported_on_its_wrench(tmp_path: Path) -> None:
    fit = pull_fit()
    rows = len(fit.experiment.time)
    none = np.empty((rows, 0, 3))
    bare = replace(fit.experiment, fiducials_rest=np.empty((0, 3)), fiducials=none)
    fit = replace(fit, experiment=bare, fiducials=none, fiducials_std=none)
    page = written(estimate_of(fit), tmp_path)
    assert "worst fiducial––" in words(page)
    assert "Paths of the fiducials" not in page


def test_an_experiment_whose_fiducials_were_never_seen_is_reported(tmp_path: Path) -> None:
    fit = pull_fit()
    unseen = replace(fit.experiment, fiducials=np.full_like(fit.experiment.fiducials, np.nan))
    assert "worst fiducial––" in words(written(estimate_of(replace(fit, experiment=unseen)), tmp_path))


@pytest.mark.parametrize("kind", ["hex8", "hex64"])
def test_bodies_of_other_elements_are_drawn_too(kind: ElementKind) -> None:
    mesh = block(kind)
    displacements, state_of_row = at_its_end(mesh.points, rows=40)
    fit = replace(pull_fit(), displacements=displacements, state_of_row=state_of_row)
    assert "data:image/png" in figure(partial(draw_body, mesh=mesh, fit=fit), (6.0, 3.0), "")


def test_noise_is_one_sigma_and_a_tare_does_not_count_as_scatter() -> None:
    fit = pull_fit(rows=4000)
    wrench = np.add(fit.experiment.wrench, [0.1, 0, 0, 0, 0, 0])
    by_name = {
        c.name: c for c in channel_residuals(replace(fit, experiment=replace(fit.experiment, wrench=wrench)))
    }
    assert [c.scatter_sigma for c in by_name.values()] == pytest.approx([1.0] * 9, rel=0.05)
    assert by_name["fx"].rms_sigma == pytest.approx(np.hypot(1.0, 0.1 / SENSOR.force_std), rel=0.05)
    assert by_name["tx"].rms == pytest.approx(SENSOR.torque_std, rel=0.05)


def test_the_fiducial_that_the_prediction_misses_is_named() -> None:
    fit = pull_fit()
    fiducials = fit.experiment.fiducials.copy()
    fiducials[:, 2] += 1e-3
    worst = worst_fiducial(replace(fit, experiment=replace(fit.experiment, fiducials=fiducials)))
    assert worst is not None
    number, rms_sigma = worst
    assert number == 2
    assert rms_sigma == pytest.approx(np.hypot(20, 1), rel=0.05)


def test_an_estimate_that_noise_explains_carries_no_warning() -> None:
    assert caveats(estimate_of(pull_fit())) == []


def test_widened_intervals_and_the_channels_behind_them_are_warned_of() -> None:
    fit = pull_fit()
    wrench = fit.experiment.wrench.copy()
    wrench[20:, 0] += 0.3
    slipped = replace(fit, experiment=replace(fit.experiment, wrench=wrench))
    found = caveats(replace(estimate_of(slipped), noise_ratio=2.4, inflation=2.4))
    assert len(found) == 2
    assert "widened 2.4 times" in found[0]
    assert re.fullmatch(r"Residuals that noise does not explain: fx of pull \(\d\.\d σ\)\.", found[1])


def test_a_ratio_at_its_bound_is_warned_of() -> None:
    ratio = ParameterEstimate(0.4999, 1e-4, (0.4996, 0.49999))
    stuck = replace(estimate_of(pull_fit()), poisson_ratio=ratio, at_bound=("poisson_ratio",))
    (warning,) = caveats(stuck)
    assert warning.startswith("ν = 0.4999 is at the bound")


def test_a_coarse_mesh_is_warned_of() -> None:
    (warning,) = caveats(replace(estimate_of(pull_fit()), discretisation_force=0.1))
    assert "changes a force by 0.1 N, which is 5 % of the largest" in warning


@pytest.mark.parametrize(
    ("ratio", "verdict"),
    [(1.0, "explains the data within"), (1.3, "nearly explains"), (3.0, "does not explain the data")],
)
def test_the_terminal_summary_says_whether_the_model_explains_the_data(ratio: float, verdict: str) -> None:
    lines = summary_text(replace(estimate_of(pull_fit()), noise_ratio=ratio), TRUTH).splitlines()
    assert lines[0] == "E = 20.00 kPa (95 %: 19.77 to 20.24)"
    assert lines[1] == "ν = 0.4512 (95 %: 0.4469 to 0.4553)"
    assert verdict in lines[2]
    assert lines[3].startswith("Truth: E = 20.1 kPa")
    assert lines[-1] == "2 iterations, 57 states solved, 12.3 s"


def test_a_uniform_extension_has_one_stretch_everywhere() -> None:
    mesh = block()
    assert largest_stretch(mesh, stretched(mesh.points, PULL_M)) == pytest.approx(1.1)
