"""What real records bear out: stiffening at large strain only, and nothing between repeats."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimator.errors import InputError
from estimator.materials import LAWS
from estimator.uniaxial import (
    UniaxialRecord,
    compare_runs,
    read_record,
    stiffening_ladder,
    stiffens_from,
)
from estimator.uniaxial.stress import uniaxial_stress

DATA = Path(__file__).parents[1] / "data" / "uniaxial"


@pytest.fixture(scope="module")
def tension() -> UniaxialRecord:
    return read_record(DATA / "ecoflex_00-30_tension_to_600_percent.csv")


@pytest.fixture(scope="module")
def compression() -> UniaxialRecord:
    return read_record(DATA / "ef30_0t_a1_compression.csv")


def made_of(law: str, shape: list[float], reach: float) -> UniaxialRecord:
    strain = np.linspace(0.01, reach, 80)
    return UniaxialRecord(
        law, "tension", strain, uniaxial_stress(LAWS[law], 30e3, np.array(shape), 1 + strain)
    )


def test_ecoflex_stiffens_at_large_strain_and_is_not_said_to_below(tension: UniaxialRecord) -> None:
    ladder = stiffening_ladder(tension)
    onset = stiffens_from(ladder)
    assert onset is not None
    assert 1.0 <= onset <= 3.0
    below = [rung for rung in ladder if rung.strain_fit < onset]
    assert below
    # within the range a stiffening law fits better all the same
    assert all(rung.closure_fit > 0.2 and not rung.claimed for rung in below)


def test_a_neo_hookean_record_is_not_said_to_stiffen() -> None:
    record = made_of("neo_hookean", [], 2.1)
    noise = np.random.default_rng(1).normal(0.0, 200.0, len(record.stress))
    assert stiffens_from(stiffening_ladder(replace(record, stress=record.stress + noise))) is None


def test_a_stiffening_record_is_said_to_stiffen_from_the_first_range_on() -> None:
    ladder = stiffening_ladder(made_of("yeoh2", [0.1], 2.1))
    assert stiffens_from(ladder) == ladder[0].strain_fit


def test_a_record_too_short_to_tell_is_refused(compression: UniaxialRecord) -> None:
    short = replace(compression, strain=compression.strain[:12], stress=compression.stress[:12])
    with pytest.raises(InputError, match="too few to tell stiffening"):
        stiffening_ladder(short)


def test_repeats_of_a_real_test_differ_in_nothing(compression: UniaxialRecord) -> None:
    repeat = read_record(DATA / "ef30_0t_a2_compression.csv")
    assert compare_runs(compression, repeat).verdict == "none"
    assert compare_runs(repeat, compression).verdict == "none"


@pytest.mark.parametrize(
    ("verdict", "size"), [("modulus", -0.15), ("slack", 0.03), ("strain_stiffening", 0.2)]
)
def test_a_real_difference_is_named_with_its_size(
    compression: UniaxialRecord, verdict: str, size: float
) -> None:
    strain, stress = np.abs(compression.strain), np.abs(compression.stress)
    changed = {
        "modulus": (strain, (1 + size) * stress),
        "slack": (strain + size, stress),
        "strain_stiffening": (strain, (1 + size * (strain / strain[-1]) ** 2) * stress),
    }
    other = replace(compression, name="other", strain=-changed[verdict][0], stress=-changed[verdict][1])
    found = compare_runs(compression, other)
    assert found.verdict == verdict
    assert found.size == pytest.approx(size, rel=0.2)
    assert found.closure_held_out > 0.7


def test_a_difference_of_another_shape_is_unknown(compression: UniaxialRecord) -> None:
    strain = np.abs(compression.strain)
    wavy = compression.stress * (1 + 0.2 * np.sin(40 * strain))
    assert compare_runs(compression, replace(compression, stress=wavy)).verdict == "unknown"


def test_a_tensile_test_is_not_held_against_a_compression_test(
    tension: UniaxialRecord, compression: UniaxialRecord
) -> None:
    with pytest.raises(InputError, match="compare runs of one test"):
        compare_runs(tension, compression)
