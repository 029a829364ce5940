"""The report of a uniaxial fit: JSON without surprises, a table, and a page that needs no network."""

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from estimator.materials import LAWS
from estimator.uniaxial import UniaxialFit, UniaxialRecord, as_json, as_text, fit_record, write_report
from estimator.uniaxial.stress import uniaxial_stress


@pytest.fixture(scope="module")
def fit() -> UniaxialFit:
    strain = np.linspace(0.05, 1.0, 40)
    stress = uniaxial_stress(LAWS["gent"], 40e3, np.array([0.6]), 1 + np.minimum(strain, 0.8))
    record = UniaxialRecord("<silicone> & co", "tension", strain, stress, facts={"Machine": "<b>bench</b>"})
    laws = [LAWS[name] for name in ("neo_hookean", "yeoh2", "gent")]
    return fit_record(record, laws, strain_fit=0.75, strain_test=1.0)


def test_json_is_plain_and_complete(fit: UniaxialFit) -> None:
    found = json.loads(json.dumps(as_json(fit), allow_nan=False))
    assert found["best"] in found["ranking"]
    assert set(found["laws"]) == {"neo_hookean", "yeoh2", "gent"}
    assert found["strain"] == {"from": 0.0, "fit": 0.75, "test": 1.0}
    modulus = found["laws"]["gent"]["youngs_modulus"]
    assert modulus["value"] == pytest.approx(40e3, rel=1e-3)
    low, high = modulus["interval95"]
    assert low <= modulus["value"] <= high
    assert found["laws"]["neo_hookean"]["closure_held_out"] == 0.0


def test_an_infinite_error_is_null_in_json(fit: UniaxialFit) -> None:
    gent = as_json(fit)["laws"]["gent"]
    assert (gent["rms_test"], gent["closure_held_out"]) == (None, None)
    assert gent["rms_fit"] < 1.0


def test_the_table_has_a_line_for_every_law_best_first(fit: UniaxialFit) -> None:
    lines = as_text(fit).splitlines()
    assert lines[0].startswith("<silicone> & co, tension: fitted to strains of 0 to 0.75")
    assert [line.split()[0] for line in lines[3:6]] == as_json(fit)["ranking"]


def test_the_page_needs_no_network_and_escapes_what_the_file_says(fit: UniaxialFit, tmp_path: Path) -> None:
    page = write_report(fit, tmp_path / "report")
    text = page.read_text(encoding="utf-8")
    assert "&lt;silicone&gt; &amp; co" in text
    assert "<b>bench" not in text
    assert not re.search(r"https?://|<script|<link", text)
    assert (tmp_path / "report" / "uniaxial.png").read_bytes().startswith(b"\x89PNG")


def test_the_page_draws_every_law_as_vectors(fit: UniaxialFit, tmp_path: Path) -> None:
    body = ET.fromstring(write_report(fit, tmp_path).read_text(encoding="utf-8")).find("body")
    assert body is not None
    drawing = body.find("figure/svg")
    assert drawing is not None
    assert not list(drawing.iter("image"))
    labels = {text.text for text in drawing.iter("text")}
    assert {"measured", "neo hookean", "yeoh2", "gent"} <= labels


def test_the_summary_does_not_praise_a_law_that_admits_no_held_out_strain(fit: UniaxialFit) -> None:
    gent = fit_record(fit.record, [LAWS["gent"]], strain_fit=0.75, strain_test=1.0)
    summary = as_text(gent).splitlines()[0]
    assert "No stable law admits all of those; gent has E = 40" in summary
