"""A published table's gap: sampling, the map, recovery of what was planted, reading and telling."""

import json
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray
from published_gaps import BENCH_OFF, NARROWER, SOFTER, KnownMap, planted

from estimator.errors import InputError
from estimator.studies.published_gap.candidate import Candidate, Size
from estimator.studies.published_gap.candidates import CANDIDATES
from estimator.studies.published_gap.composition import Part, in_turn, together
from estimator.studies.published_gap.diagnosis import GapDiagnosis, Ranking, Withheld, withheld_parts
from estimator.studies.published_gap.learning import Check, ResponseMap
from estimator.studies.published_gap.paper_estimator import Readings
from estimator.studies.published_gap.pattern import PatternModel
from estimator.studies.published_gap.pattern_fit import PatternFit, PatternResult
from estimator.studies.published_gap.proposals import proposals
from estimator.studies.published_gap.published import PublishedEstimate, paper_table, read_table
from estimator.studies.published_gap.redone import Redone
from estimator.studies.published_gap.reporting.report import write_gap
from estimator.studies.published_gap.reporting.telling import gap_text
from estimator.studies.published_gap.retractions import SetUp
from estimator.studies.published_gap.sampling import sample_posterior
from estimator.studies.published_gap.simulations import CONDITIONS, learning_cases
from estimator.studies.running.case import run_case

FloatArray = NDArray[np.float64]
Causes = tuple[Candidate, ...]


@pytest.mark.parametrize(("dimension", "deviation"), [(1, 0.3), (3, 0.05), (6, 1.0)])
def test_the_evidence_of_a_linear_problem_is_the_known_one(dimension: int, deviation: float) -> None:
    seen = np.linspace(0.5, -1.0, dimension)
    found = sample_posterior(
        lambda draws: (
            -0.5 * np.sum(((draws - seen) / deviation) ** 2, axis=1)
            - dimension * np.log(deviation * np.sqrt(2 * np.pi))
        ),
        dimension,
        np.random.default_rng(1),
    )
    variance = 1 + deviation**2
    known = -0.5 * np.sum(seen**2) / variance - 0.5 * dimension * np.log(2 * np.pi * variance)
    assert found.log_evidence == pytest.approx(known, abs=0.3)
    np.testing.assert_allclose(found.draws.mean(axis=0), seen / variance, atol=0.1)
    np.testing.assert_allclose(found.draws.std(axis=0), deviation / np.sqrt(variance), rtol=0.15)


def test_a_posterior_of_two_modes_keeps_both() -> None:
    found = sample_posterior(
        lambda draws: np.logaddexp(*(-0.5 * ((draws[:, 0] - m) / 0.1) ** 2 for m in (-1.5, 1.5))),
        1,
        np.random.default_rng(2),
    )
    assert 0.35 < np.mean(found.draws > 0) < 0.65


def fitted(table_causes: Causes, model_causes: Causes, truth: FloatArray) -> PatternResult:
    table = planted(table_causes, truth)
    fit = PatternFit(PatternModel(table, model_causes, KnownMap()), (True,) * 18)
    return fit.found(fit.run())


# E of the materials, ν of the tissue, four scatters and their power, then sizes.
BASE = np.zeros(9)


@pytest.mark.parametrize(
    ("cause", "size", "quantile"), [(SOFTER, "softer compliance", 1.0), (NARROWER, "narrower share", 0.5)]
)
def test_a_planted_cause_is_found_with_its_size(cause: Candidate, size: str, quantile: float) -> None:
    truth = np.append(BASE, quantile)
    results = [fitted((cause,), causes, truth) for causes in ((), (SOFTER,), (NARROWER,), (BENCH_OFF,))]
    ranking = Ranking.of(results)
    assert ranking.leading.model.causes == (cause,)
    assert next(iter(ranking.by_cause)) == cause.name
    planted_size = float(ranking.leading.model.size_values(truth[None])[size][0])
    median, low, high = ranking.leading.sizes()[size]
    assert low < planted_size < high
    assert median == pytest.approx(planted_size, rel=0.35)


def test_where_locking_alone_acted_no_cause_leads_by_much_and_the_gap_closes() -> None:
    results = [fitted((), causes, BASE) for causes in ((), (SOFTER,), (NARROWER,), (BENCH_OFF,))]
    locking = Ranking.of(results).best(0)
    assert max(result.log_evidence for result in results) - locking.log_evidence < 1.0
    closed = locking.closed(np.ones(18, dtype=bool))
    assert closed["nu"][0] > 0.8


def test_a_withheld_anchoring_is_predicted() -> None:
    truth = np.append(BASE, 1.0)
    table = planted((SOFTER,), truth)
    parts = dict(withheld_parts(table))
    assert list(parts) == ["two sides", "one side", "hard", "middle", "soft"]
    rows = parts["two sides"]
    shares = {}
    for causes in ((), (SOFTER,)):
        fit = PatternFit(PatternModel(table, causes, KnownMap()), tuple(map(bool, ~rows)))
        shares[len(causes)] = fit.found(fit.run()).closed(rows)["E"][0]
    assert shares[1] > 0.7
    assert shares[1] > shares[0]


def test_the_papers_table_has_its_eighteen_rows() -> None:
    table = paper_table()
    assert len(table.estimates) == 18
    assert table.materials == ("1:1:0", "1:1:1", "1:1:2")
    first, last = table.estimates[0], table.estimates[-1]
    assert (first.youngs_modulus_pa, first.poisson_ratio) == (26450, 0.304)
    assert (last.anchoring, last.motion, last.poisson_ratio) == ("two_sides", "twist_and_pull", 0.1608)
    assert sorted(np.bincount(table.condition_of)) == [3] * 6


TOML = """[bench."A"]
youngs_modulus_pa = 30000
std_pa = 2000
[[estimate]]
material = "A"
anchoring = "one_side"
motion = "pull"
youngs_modulus_pa = 25000
poisson_ratio = 0.3
[set_up]
way_m = 0.02
"""
CSV = """material,anchoring,motion,youngs_modulus_pa,poisson_ratio,bench_pa,bench_std_pa
A,one_side,pull,25000,0.3,30000,2000
A,two_sides,twist_and_pull,24000,0.31,30000,2000
"""


def diagnosed() -> GapDiagnosis:
    """Return a diagnosis of a table in which E falls with E, by models of none, one and two causes."""
    truth = np.append(BASE, 1.0)
    table = planted((SOFTER,), truth)
    chosen: list[Causes] = [(), (SOFTER,), (SOFTER, NARROWER)]

    def learnt(rows: NDArray[np.bool_]) -> Ranking:
        fits = [
            PatternFit(PatternModel(table, causes, KnownMap()), tuple(map(bool, rows))) for causes in chosen
        ]
        return Ranking.of([fit.found(fit.run()) for fit in fits])

    everything = np.ones(18, dtype=bool)
    name, rows = withheld_parts(table)[0]
    return GapDiagnosis(
        table,
        cast(ResponseMap, KnownMap()),
        (Check("softer", (1.0,), np.ones(6), np.full(6, 1.002), np.full(6, 0.4), np.full(6, 0.401)),),
        learnt(everything),
        (Withheld(name, rows, learnt(~rows)),),
    )


def test_a_diagnosis_is_told_in_tables_drawn_and_written(tmp_path: Path) -> None:
    diagnosis = diagnosed()
    text = gap_text(diagnosis)
    lines = text.splitlines()
    assert sum(line.startswith(("  hard", "  middle", "  soft ")) for line in lines) >= 18
    assert any(line.strip().startswith("softer") and "compliance" in line for line in lines)
    assert any(line.strip().startswith("two sides") and "leading" in line for line in lines)
    assert any(line.split() == ["softer", "1", "0.20", "0.0010"] for line in lines)
    assert proposals(diagnosis)[0].startswith("The table")
    one = PublishedEstimate("hard", "one_side", "pull", 3e4, 0.4)
    redone = [Redone(one, 36e3, (28e3, 0.41), (np.nan, np.nan))]
    files = write_gap(diagnosis, redone, tmp_path, {"retraction": "0"})
    assert files[0].read_text(encoding="utf-8").count("<svg") == 1
    assert files[1].stat().st_size > 10_000
    data = json.loads(files[2].read_text(encoding="utf-8"))
    assert sum(model["probability"] for model in data["models"]) == pytest.approx(1.0)
    assert data["redone"][0]["ours"] == [None, None]


def test_two_changes_together_leave_the_product_of_what_each_leaves() -> None:
    random = np.random.default_rng(4)
    base = Readings(random.normal(size=(1, 2, 4, 3)), random.normal(size=(1, 2, 3)))
    both = together(base, [base.times(np.array([-0.2])), base.times(np.array([-0.3]))])
    np.testing.assert_allclose(both.moved, 0.56 * base.moved)
    other = Readings(random.normal(size=(1, 2, 4, 3)), random.normal(size=(1, 2, 3)))
    np.testing.assert_allclose(together(base, [other]).force, base.force + other.force)


def test_a_table_is_read_from_either_kind_of_file(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(TOML, encoding="utf-8")
    (tmp_path / "a.csv").write_text(CSV, encoding="utf-8")
    one, other = (read_table(tmp_path / name) for name in ("a.toml", "a.csv"))
    assert one.set_up == SetUp(way_m=0.02)
    assert one.bench == other.bench
    assert one.estimates[0] == other.estimates[0]
    assert len(other.estimates) == 2


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.toml", TOML.replace('"pull"', '"push"'), "motion 'push' is none of pull, gradual_tangent_pull"),
        ("a.toml", TOML.replace("0.3\n", "0.6\n"), "is not between −1 and 0.5"),
        ("a.toml", TOML.replace('material = "A"', 'material = "B"'), "material 'B' is none of A"),
        ("a.toml", TOML.replace("std_pa = 2000", "std_pa = 0"), "must be above zero"),
        ("a.toml", TOML.replace("poisson_ratio", "nu"), "has no number poisson_ratio"),
        ("a.toml", TOML.replace("way_m", "way_mm"), "set_up has no 'way_mm'"),
        ("a.toml", TOML + "[other]\nx = 1\n", "[other] is not known"),
        ("a.toml", "estimate = 3", "write [bench.MATERIAL]"),
        ("a.toml", "", "has no estimate"),
        ("a.csv", CSV.replace("bench_pa", "bench"), "has no column 'bench_pa'"),
        ("a.csv", CSV.replace("24000", "soft"), "line 3: youngs_modulus_pa = 'soft' is no number"),
        ("a.csv", CSV.replace("0.31,30000", "0.31,31000"), "another bench test of A"),
        ("a.txt", CSV, "neither .toml nor .csv"),
    ],
)
def test_a_table_that_cannot_be_used_is_told_in_one_line(
    tmp_path: Path, name: str, text: str, words: str
) -> None:
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_table(file)
    assert words in str(refused.value)
    assert str(file) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_the_learnt_map_holds_at_a_size_that_it_was_not_learnt_from() -> None:
    thicker = Candidate(
        "thicker",
        "thickness_error:about_middle",
        (Size("excess", "1", (-0.2, -0.1, 0.1, 0.2), 0.1, one_sided=False),),
        checks=((0.15,),),
        called="thicker",
    )
    set_up, cells = SetUp(steps=1, way_m=0.003, tangent_rad=0.1, twist_rad=0.1), (6, 6, 1)
    cases = learning_cases(set_up, [thicker], cells)
    response = ResponseMap(set_up, [thicker], {case.identity: run_case(case) for case in cases}, cells=cells)
    assert response.missing == []
    check = response.checks(thicker)[0]
    assert check.modulus_off < 0.01
    assert check.ratio_off < 0.005
    gain, ratio = response.locking
    assert gain.shape == (len(CONDITIONS),)
    assert np.all(ratio < 0.499)
    thick, _ = response.estimates([(thicker, np.array([[0.1]]))])
    np.testing.assert_allclose(thick[0] / gain, 1.1, rtol=0.03)


@pytest.mark.parametrize("compliances", [(0.3, 1.2), (1.2, 0.3), (0.0, 2.0)])
@pytest.mark.parametrize("thicker", [0.6, 1.0, 1.5])
def test_springs_in_series_with_a_thicker_tissue_leave_the_force_that_they_leave(
    compliances: tuple[float, float], thicker: float
) -> None:
    base = Readings(np.ones((1, 2, 4, 3)), np.ones((1, 2, 3)))

    def spring(compliance: float) -> Part:
        return Part(lambda stiffer: base.times(1 / (1 + compliance * stiffer) - 1), True)

    parts = [*map(spring, compliances), Part(lambda _: base.times(np.array([thicker - 1])), False)]
    left = thicker / (1 + thicker * sum(compliances))
    np.testing.assert_allclose(in_turn(base, parts).force, left, rtol=1e-12)


def test_a_size_means_the_same_in_every_tissue() -> None:
    compliance = next(c for c in CANDIDATES if c.name == "gripper_compliance").sizes[0]
    moduli = np.array([4e3, 36e3])
    there = compliance.at_reference(np.array([2e-4, 2e-4]), moduli)
    assert there[1] / there[0] == pytest.approx(9.0)
    assert float(compliance.in_tissue(there[1:], 36e3)[0]) == pytest.approx(2e-4)
    assert len({candidate.name for candidate in CANDIDATES}) == len(CANDIDATES)
