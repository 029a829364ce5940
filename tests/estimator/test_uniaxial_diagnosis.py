"""Causes that were put into bench tests are named, also in forms that the catalogue lacks; nothing else is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.bench_simulator import KNOWN, Protocol, drawn, maxwell, record, soft_machine
from benchmarks.bench_tests import grade
from estimator.errors import InputError
from estimator.uniaxial.diagnosis import (
    BenchMode,
    BenchTest,
    as_json,
    as_text,
    diagnose_bench,
)
from estimator.uniaxial.reading.whole import read_bench_test

DATA = Path(__file__).resolve().parents[1] / "data" / "uniaxial"
CAUSES = [name for name, known in KNOWN.items() if known.label not in ("none", "unknown")]


@pytest.mark.parametrize("name", CAUSES)
def test_a_cause_of_clear_size_is_named(name: str) -> None:
    known = KNOWN[name]
    found = diagnose_bench([drawn(known, "medium", 0.03, seed=77)])
    assert grade(found, known.label) in ("named", "among")
    assert found.ranking.probability_of(known.label) > 0.8
    assert found.held_out.closure > 0.5


@pytest.mark.parametrize("mode", ["tension", "compression", "shear"])
@pytest.mark.parametrize("noise", [0.003, 0.02])
def test_a_clean_record_has_no_cause(mode: BenchMode, noise: float) -> None:
    test = Protocol(mode=mode, noise=noise)
    found = diagnose_bench([record(test, test.elastic(test.strain), seed=5)])
    assert found.verdict == ("none",)
    assert found.alike == () and found.sizes == ()
    assert found.modulus_after[0] == pytest.approx(test.modulus, rel=0.02)
    assert as_text(found).startswith("None: a Neo-Hookean law explains the tests.")
    assert as_json(found)["probabilities"]["none"] > 0.8


def test_what_no_cause_explains_is_unknown() -> None:
    found = diagnose_bench([drawn(KNOWN["a drifting load cell"], "large", 0.03, seed=77)])
    assert found.verdict == ("unknown",)
    assert as_text(found).startswith("Unknown: ")


def test_relaxation_is_predicted_at_a_rate_that_was_left_out() -> None:
    rng = np.random.default_rng(3)
    tests = [Protocol(rate=rate, cycles=2) for rate in (0.01, 0.08)]
    made = [
        record(test, maxwell(test, 0.6, np.random.default_rng(3)), seed) for seed, test in enumerate(tests)
    ]
    found = diagnose_bench(made)
    assert found.verdict == ("viscoelasticity",)
    assert found.held_out.what == "each record"
    assert found.held_out.closure > 0.9
    share, time = found.sizes
    assert share.low < 0.6 * 1.05 and share.high > 0.6 * 0.95
    expected = float(np.exp(rng.uniform(np.log(2.0), np.log(30.0))))
    assert time.value == pytest.approx(expected, rel=0.1)


def test_vhb_relaxes_and_a_rate_that_was_left_out_is_predicted() -> None:
    found = diagnose_bench([read_bench_test(path) for path in sorted(DATA.glob("vhb_tension_*.csv"))])
    assert "viscoelasticity" in found.verdict
    assert found.held_out.what == "each record"
    assert found.held_out.closure > 0.5


def test_a_soft_machine_does_not_soften_the_specimen() -> None:
    test = Protocol(noise=0.003)
    found = diagnose_bench([record(test, soft_machine(test, 0.6, np.random.default_rng(0)), seed=1)])
    assert found.verdict == ("machine_compliance",)
    (compliance,) = (size for size in found.sizes if size.label == "machine_compliance")
    assert compliance.value == pytest.approx(0.6, rel=0.15)
    assert found.modulus_after[0] == pytest.approx(test.modulus, rel=0.1)
    assert found.modulus_before[0] < 0.8 * test.modulus


def test_a_hold_from_the_first_row_shows_relaxation_alone() -> None:
    time = np.linspace(0.0, 200.0, 120)
    stress = 3e3 * (1 + 0.5 * np.exp(-time / 20)) + 5 * np.random.default_rng(2).normal(size=120)
    found = diagnose_bench([BenchTest("hold", "tension", np.full(120, 0.3), stress, time)])
    assert found.verdict == ("viscoelasticity",)
    assert "slack: strain does not change" in found.not_tried
    assert found.held_out.closure > 0.5


def test_units_and_time_scale_change_no_verdict() -> None:
    factor = 1e4
    one = drawn(KNOWN["relaxation (Maxwell)"], "small", 0.03, seed=4)
    assert one.time is not None
    other = replace(one, stress=one.stress * factor, time=one.time * factor)
    first, second = diagnose_bench([one]), diagnose_bench([other])
    assert first.verdict == second.verdict
    assert second.modulus_after[0] == pytest.approx(factor * first.modulus_after[0], rel=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_any_few_rows_of_a_record_get_an_answer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    whole = drawn(KNOWN["slack"], "large", 0.03, seed)
    assert whole.time is not None
    kept = np.sort(rng.choice(len(whole.strain), size=int(rng.integers(12, 40)), replace=False))
    few = replace(whole, strain=whole.strain[kept], stress=whole.stress[kept], time=whole.time[kept])
    if seed % 2:
        few = replace(few, time=None)
    found = diagnose_bench([few])
    assert sum(found.ranking.probabilities.values()) == pytest.approx(1.0)
    assert found.modulus_before[0] > 0
    assert grade(found, "slack") != "wrong"


@pytest.mark.parametrize(
    ("test", "complaint"),
    [
        (BenchTest("made", "tension", np.arange(5.0), np.arange(5.0)), "made: 5 rows"),
        (BenchTest("made", "tension", np.linspace(0, 1, 30), -np.linspace(0, 1, 30)), "does not rise"),
        (BenchTest("made", "tension", np.full(30, 0.2), np.linspace(1, 0.5, 30)), "there is no time"),
    ],
)
def test_what_cannot_be_diagnosed_is_refused(test: BenchTest, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        diagnose_bench([test])
