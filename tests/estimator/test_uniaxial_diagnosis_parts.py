"""The parts of the diagnosis of bench tests: rows, specimen, evidence, ranking, pages."""

import json
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.bench_simulator import KNOWN, Protocol, drawn
from estimator.errors import InputError
from estimator.materials import LAWS
from estimator.uniaxial.diagnosis import BenchMode, BenchTest, diagnose_bench, write_report
from estimator.uniaxial.diagnosis.causes import forms_for, not_shown
from estimator.uniaxial.diagnosis.evidence import Weighed, specimen_with, weigh
from estimator.uniaxial.diagnosis.likelihood import Likelihood
from estimator.uniaxial.diagnosis.rows import MOST_ROWS, Rows, rows_of, turning_points
from estimator.uniaxial.diagnosis.specimen import Specimen, stress_per_modulus
from estimator.uniaxial.diagnosis.verdict import Answer, Ranking
from estimator.uniaxial.reading.whole import read_bench_test
from estimator.uniaxial.stress import unit_stress_and_energy

NOTHING = np.empty(0)


def clean_rows(test: Protocol) -> Rows:
    return rows_of(BenchTest("made", test.mode, test.strain, test.elastic(test.strain), test.time))


@pytest.mark.parametrize("mode", ["tension", "compression", "shear"])
def test_the_null_specimen_is_neo_hookean(mode: BenchMode) -> None:
    test = Protocol(mode=mode)
    rows = clean_rows(test)
    expected = test.elastic(rows.strain)
    assert stress_per_modulus(Specimen(), rows) * test.modulus == pytest.approx(expected)


@given(compliance=st.floats(0.01, 4.0), reach=st.floats(0.05, 1.0), slack=st.floats(0.0, 0.3))
@settings(max_examples=30, deadline=None)
def test_what_the_machine_yields_is_missing_from_the_travel(
    compliance: float, reach: float, slack: float
) -> None:
    rows = clean_rows(Protocol(reach=reach))
    borne = stress_per_modulus(Specimen(compliance=compliance, slack=slack * reach), rows)
    left = np.maximum(rows.strain - compliance * borne - slack * reach, 0.0)
    test = Protocol(reach=reach)
    assert borne == pytest.approx(test.elastic(left) / test.modulus, abs=3e-4 * float(borne.max()))


@given(exponent=st.floats(-4.0, 6.0), mode=st.sampled_from(["uniaxial", "shear"]))
@settings(max_examples=30, deadline=None)
def test_an_ogden_law_is_the_derivative_of_its_energy(
    exponent: float, mode: Literal["uniaxial", "shear"]
) -> None:
    where = np.linspace(0.6, 2.0, 400)
    stress, energy = unit_stress_and_energy(LAWS["ogden1"], np.array([exponent]), where, mode)
    assert stress[1:-1] == pytest.approx(np.gradient(energy, where)[1:-1], abs=1e-3, rel=1e-3)


@given(share=st.floats(0.05, 3.0), time=st.floats(0.5, 50.0))
@settings(max_examples=20, deadline=None)
def test_a_step_of_strain_relaxes_by_its_exponential(share: float, time: float) -> None:
    at = np.arange(61.0)
    rows = rows_of(BenchTest("hold", "shear", 0.3 + 0 * at, 2 - at / 60, at))
    borne = stress_per_modulus(Specimen(relaxation=((share, time),)), rows)
    assert borne == pytest.approx(0.1 * (1 + share * np.exp(-rows.time / time)))


def test_friction_bears_on_the_way_out_and_sets_free_on_the_way_back() -> None:
    rows = clean_rows(Protocol(mode="compression", cycles=1))
    rubbed = stress_per_modulus(Specimen(sliding_friction=(0.3, 0.01)), rows)
    smooth = stress_per_modulus(Specimen(), rows)
    out, back = rows.part == 0, (rows.part == 1) & (rows.strain < 0.35)
    assert np.all(rubbed[out][1:] > smooth[out][1:])
    assert np.all(rubbed[back][:-1] < smooth[back][:-1])


def test_rows_are_averaged_and_never_across_a_turning_point() -> None:
    test = Protocol(cycles=3)
    strain = np.repeat(test.strain, 5) + np.tile(np.arange(5) * 1e-9, len(test.strain))
    rows = rows_of(BenchTest("made", "tension", strain, test.elastic(strain), np.arange(float(len(strain)))))
    assert len(rows.strain) <= MOST_ROWS
    assert len(turning_points(strain)) == 5
    assert rows.strain.max() == pytest.approx(strain.max())


@pytest.mark.parametrize("name", ["slack", "set", "soft machine"])
def test_the_evidence_is_the_integral_over_the_prior(name: str) -> None:
    label = KNOWN[name].label
    made = drawn(KNOWN[name], "small", 0.03, seed=3)
    likelihood = Likelihood([rows_of(made)])
    (form,) = (one for one in forms_for(likelihood.tests) if one.label == label)
    weighed = weigh((form,), likelihood)
    assert weighed is not None
    rows, deviation = likelihood.tests[0], float(np.sqrt(weighed.covariance[0, 0]))
    grid = weighed.z[0] + deviation * np.linspace(-8, 8, 161)
    null = likelihood.along([stress_per_modulus(Specimen(), rows)])
    density = [_density(likelihood, rows, specimen_with((form,), np.array([z])), null) for z in grid]
    logs = np.array(density) - 0.5 * grid**2
    integral = logs.max() + np.log(
        np.sum(np.exp(logs - logs.max())) * (grid[1] - grid[0]) / np.sqrt(2 * np.pi)
    )
    assert weighed.log_evidence == pytest.approx(integral, abs=0.5)


def _density(likelihood: Likelihood, rows: Rows, specimen: Specimen, null: np.ndarray) -> float:
    fitted = likelihood.of(likelihood.along([stress_per_modulus(specimen, rows)]), null)
    return -np.inf if fitted is None else fitted.log_density


@pytest.mark.parametrize(
    ("probabilities", "leader", "shared"),
    [
        ({("a",): 0.9, ("b",): 0.05, ("none",): 0.05}, ("a",), ("a",)),
        ({("a",): 0.6, ("none",): 0.3, ("b",): 0.1}, ("none",), ("none",)),
        ({("a", "b"): 0.5, ("a", "c"): 0.4, ("a",): 0.1, ("none",): 0.0}, ("a", "b"), ("a",)),
        ({("a",): 0.5, ("b",): 0.4, ("none",): 0.1}, ("a",), ("a",)),
        ({("a", "b"): 0.8, ("a",): 0.1, ("none",): 0.1}, ("a", "b"), ("a", "b")),
    ],
)
def test_what_is_named_is_what_plausible_answers_share(
    probabilities: dict[Answer, float], leader: Answer, shared: Answer
) -> None:
    one = Weighed((), 0.0, NOTHING, np.empty((0, 0)), 1.0, 0.1)
    ranking = Ranking(probabilities, dict.fromkeys(probabilities, one))
    assert (ranking.leader, ranking.shared) == (leader, shared)


def test_causes_that_a_record_cannot_show_are_not_tried() -> None:
    made = drawn(KNOWN["nothing, tension"], "small", 0.03, seed=1)
    on_marks = BenchTest("made", "tension", made.strain, made.stress, strain_on_specimen=True)
    rows = [rows_of(on_marks)]
    missing = {"viscoelasticity", "machine_compliance", "clamp_slip", "platen_friction"}
    assert set(not_shown(rows)) == missing
    assert not missing & {form.label for form in forms_for(rows)}


def written(folder: Path, strain: np.ndarray, stress: np.ndarray) -> Path:
    path = folder / "record.csv"
    lines = [f"{row},{e:.6f},{s:.6f}" for row, (e, s) in enumerate(zip(strain, stress, strict=True))]
    path.write_text("\n".join(["Time (s),Shear strain (-),Shear stress (kPa)", *lines]), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("end", "kept"),
    [
        ("relaxes", "all"),
        ("slips", "all"),
        ("tears", "to the tear"),
    ],
)
def test_only_a_tear_ends_a_record(tmp_path: Path, end: str, kept: str) -> None:
    up = np.linspace(0.0, 0.5, 60)
    further = np.full(30, 0.5) if end == "relaxes" else np.linspace(0.505, 0.7, 30)
    fallen = {
        "relaxes": 5.0 * (0.4 + 0.6 * np.exp(-np.arange(30) / 8)),
        "slips": 10 * further - 1.5,
        "tears": np.full(30, 0.1),
    }[end]
    path = written(tmp_path, np.concatenate([up, further]), np.concatenate([10 * up, fallen]))
    read = read_bench_test(path)
    assert read.mode == "shear"
    assert len(read.strain) == (90 if kept == "all" else 60)
    assert bool(read.left_out) == (kept != "all")


def test_a_record_in_which_nothing_changes_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, np.linspace(0.0, 0.5, 30), np.full(30, 2.0))
    with pytest.raises(InputError, match="does not change"):
        read_bench_test(path)


def test_a_report_is_a_page_with_data_and_a_picture(tmp_path: Path) -> None:
    found = diagnose_bench([drawn(KNOWN["slack"], "medium", 0.03, seed=2)])
    report = write_report(found, tmp_path / "out")
    text = report.read_text(encoding="utf-8")
    assert "Slack causes the gap to a Neo-Hookean law" in text
    assert "How large" in text and "<svg" in text
    data = json.loads((tmp_path / "out" / "diagnosis.json").read_text(encoding="utf-8"))
    assert data["verdict"] == ["slack"]
    assert (tmp_path / "out" / "diagnosis.png").read_bytes().startswith(b"\x89PNG")
