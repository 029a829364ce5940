"""Causes that were put into bench tests are named, also in forms that the catalogue lacks."""

from collections.abc import Callable

import bench_simulator as bench
import numpy as np
import pytest

from estimator.errors import InputError
from estimator.uniaxial.diagnosis import BenchMode, BenchTest, as_json, as_text, diagnose_bench
from estimator.uniaxial.diagnosis.rows import MOST_ROWS, rows_of, turning_points
from estimator.uniaxial.diagnosis.specimen import Specimen, stress_per_modulus

FloatArray = bench.FloatArray

CAUSES: dict[str, tuple[str, Callable[[FloatArray], FloatArray], BenchMode]] = {
    "Fung": ("strain_stiffening", bench.fung, "tension"),
    "Maxwell": ("viscoelasticity", bench.maxwell, "tension"),
    "KWW": ("viscoelasticity", bench.stretched_exponential, "tension"),
    "Ogden-Roxburgh": ("stress_softening", bench.ogden_roxburgh, "tension"),
    "exponential softening": ("stress_softening", bench.exponential_softening, "tension"),
    "slack": ("slack", bench.with_slack, "tension"),
    "set": ("permanent_set", bench.with_set, "tension"),
    "soft machine": ("machine_compliance", bench.with_soft_machine, "tension"),
    "slip": ("clamp_slip", bench.with_slip, "tension"),
    "friction": ("platen_friction", bench.with_friction, "compression"),
}


@pytest.mark.parametrize("case", CAUSES)
def test_a_cause_of_clear_size_is_named(case: str) -> None:
    label, stress, mode = CAUSES[case]
    strain = bench.cycles()
    found = diagnose_bench([bench.bench_test(strain, stress(strain), 0.01, seed=7, mode=mode)])
    answers = {one for answer in (found.verdict, *found.alike) for one in answer}
    assert label in found.verdict or label in answers
    assert found.ranking.probability_of(label) > 0.5
    assert found.held_out.closure > 0.5


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("noise", [0.005, 0.02])
def test_a_clean_record_has_no_cause(noise: float, seed: int) -> None:
    strain = bench.cycles()
    found = diagnose_bench([bench.bench_test(strain, bench.neo_hookean(strain), noise, seed)])
    assert found.verdict == ("none",)
    assert found.modulus_after[0] == pytest.approx(bench.MODULUS, rel=0.02)
    assert as_text(found).startswith("None")
    assert as_json(found)["probabilities"]["none"] > 0.8


@pytest.mark.parametrize("mode", ["tension", "compression"])
def test_the_null_specimen_is_neo_hookean(mode: BenchMode) -> None:
    strain = bench.cycles()
    expected = bench.neo_hookean(strain, 1.0 if mode == "tension" else -1.0)
    rows = rows_of(BenchTest("made", mode, strain, expected, bench.times(strain)))
    kept = stress_per_modulus(Specimen(), rows) * bench.MODULUS
    assert kept == pytest.approx(rows.stress, abs=2e-3 * float(expected.max()))


def test_shear_of_a_neo_hookean_specimen_is_a_third_of_the_modulus() -> None:
    strain = np.linspace(0.0, 1.0, 50)
    rows = rows_of(BenchTest("made", "shear", strain, strain))
    assert stress_per_modulus(Specimen(), rows) == pytest.approx(rows.strain / 3)


def test_rows_are_averaged_and_never_across_a_turning_point() -> None:
    strain = bench.cycles(rows=500)
    rows = rows_of(bench.bench_test(strain, bench.neo_hookean(strain), 0.01, seed=1))
    assert len(rows.strain) <= MOST_ROWS
    assert len(turning_points(strain)) == 5
    assert rows.strain.max() == strain.max()


def test_too_few_rows_are_refused_by_name() -> None:
    with pytest.raises(InputError, match="made: 5 rows"):
        diagnose_bench([BenchTest("made", "tension", np.arange(5.0), np.arange(5.0))])
