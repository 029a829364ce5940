"""What of a test is its first loading, where its zeros lie, and whether it pulled or pushed."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.bad_input.samples.machine_exports import YOUNGS_MODULUS, neo_hookean_kPa
from estimator.errors import InputError
from estimator.materials import LAWS
from estimator.uniaxial import Stated, UniaxialRecord, fit_record, read_record

FloatArray = NDArray[np.float64]
NOISE = [(0.0, 0.0), (0.002, 0.0), (0.003, 5e-4)]
WORDLESS = "Strain (-),Stress (kPa)"


def pulled(strain: FloatArray) -> FloatArray:
    return neo_hookean_kPa(np.maximum(strain, 0.0), "tension")


def ramp(begin: float, end: float, rows: int) -> FloatArray:
    return np.linspace(begin, end, rows, endpoint=False)


def read(
    folder: Path,
    strain: FloatArray,
    stress: FloatArray,
    noise: tuple[float, float] = (0.0, 0.0),
    names: str = "Strain (-),Tensile stress (kPa)",
    stated: Stated | None = None,
) -> UniaxialRecord:
    rng = np.random.default_rng(5)
    stress = stress + noise[0] * np.abs(stress).max() * rng.standard_normal(len(stress))
    strain = strain + noise[1] * rng.standard_normal(len(strain))
    file = folder / "test.csv"
    file.write_text("\n".join([names, *(f"{e:.6f},{s:.6f}" for e, s in zip(strain, stress, strict=True))]))
    return read_record(file, stated or Stated())


def modulus(record: UniaxialRecord) -> float:
    return fit_record(record, [LAWS["neo_hookean"]]).best.fit.youngs_modulus.value


@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize("amplitudes", [(0.6, 0.6, 0.6), (0.4, 0.6, 0.8), (0.8, 0.6, 0.4), (0.6, 0.61, 0.62)])
@pytest.mark.parametrize("rows", [20, 60])
def test_the_first_loading_ends_at_the_first_reversal(
    rows: int, amplitudes: tuple[float, ...], noise: tuple[float, float], tmp_path: Path
) -> None:
    strain = np.concatenate([part for a in amplitudes for part in (ramp(0, a, rows), ramp(a, 0, rows))])
    softened = np.where(np.arange(len(strain)) <= rows, 1.0, 0.5)
    record = read(tmp_path, strain, softened * pulled(strain), noise)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.015)
    assert abs(len(record.strain) - rows) <= 2
    assert any("behind the first reversal" in sentence for sentence in record.left_out)


@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize("torn_at", [0.3, 0.6, 1.2])
@pytest.mark.parametrize("left", [0.0, 0.15])
def test_a_test_past_failure_ends_at_the_fall_of_stress(
    left: float, torn_at: float, noise: tuple[float, float], tmp_path: Path
) -> None:
    strain = ramp(0, 1.5, 150)
    stress = np.where(strain < torn_at, pulled(strain), left * pulled(np.array([torn_at])))
    record = read(tmp_path, strain, stress, noise)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.02)
    assert record.strain.max() == pytest.approx(torn_at, abs=0.03)
    assert any("behind the fall of stress" in sentence for sentence in record.left_out)


@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize("relaxed", [0.0, 0.3])
def test_a_rest_on_the_way_is_no_end(relaxed: float, noise: tuple[float, float], tmp_path: Path) -> None:
    strain = np.concatenate([ramp(0, 0.3, 40), np.full(100, 0.3), ramp(0.3, 0.8, 60)])
    stress = pulled(strain)
    stress[40:140] *= 1 - relaxed * (1 - np.exp(-np.arange(100) / 20))
    record = read(tmp_path, strain, stress, noise)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.015)
    assert record.strain.max() > 0.78


@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize(("steps", "rows"), [(8, 30), (20, 30), (40, 10)])
def test_a_stepwise_test_is_one_loading(
    steps: int, rows: int, noise: tuple[float, float], tmp_path: Path
) -> None:
    strain = np.repeat(np.linspace(0, 0.8, steps), rows)
    record = read(tmp_path, strain, pulled(strain), noise)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.02)
    assert record.strain.max() > 0.78


@pytest.mark.parametrize("offset", [0.0, 0.3])
@pytest.mark.parametrize("slack", [0.05, 0.15])
@pytest.mark.parametrize("noise", NOISE)
def test_slack_is_found_told_and_taken_off(
    noise: tuple[float, float], slack: float, offset: float, tmp_path: Path
) -> None:
    strain = ramp(0, 0.8 + slack, 120)
    record = read(tmp_path, strain, pulled(strain - slack) + offset, noise)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.015)
    assert any("slack, no load up to a strain" in sentence for sentence in record.left_out)
    assert any("zero strain lies where the specimen takes load" in sentence for sentence in record.assumed)


@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize(
    ("stress_of", "told"),
    [
        (lambda strain: pulled(strain) + 0.6, "an offset of the load cell"),
        (lambda strain: pulled(strain) - 0.6, "an offset of the load cell"),
        (lambda strain: pulled(strain + 0.04), "a preload"),
    ],
)
def test_stress_at_zero_strain_is_told_and_compensated(
    stress_of: object, told: str, noise: tuple[float, float], tmp_path: Path
) -> None:
    strain = ramp(0, 0.8, 100)
    stress = stress_of(strain)  # type: ignore[operator]
    record = read(tmp_path, strain, stress, noise)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.02)
    assert any(told in sentence for sentence in record.assumed)
    kept = read(tmp_path, strain, stress, noise, stated=Stated(keep_zero=True))
    assert kept.assumed == ()
    assert abs(modulus(kept) / YOUNGS_MODULUS - 1) > 0.02


def test_rows_before_the_test_moves_and_rows_backwards_change_nothing(tmp_path: Path) -> None:
    strain = np.concatenate([np.zeros(50), ramp(0, 0.8, 80)])
    assert modulus(read(tmp_path, strain, pulled(strain))) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)
    backwards = read(tmp_path, strain[::-1], pulled(strain)[::-1])
    assert modulus(backwards) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)
    assert any("from the end of the test to its beginning" in sentence for sentence in backwards.assumed)


@pytest.mark.parametrize("reach", [0.25, 0.4, 0.6])
@pytest.mark.parametrize("mode", ["tension", "compression"])
def test_an_unsigned_curve_tells_its_mode_by_its_shape_and_it_is_said(
    mode: str, reach: float, tmp_path: Path
) -> None:
    strain = np.linspace(0, reach, 80)
    record = read(tmp_path, strain, neo_hookean_kPa(strain, mode), (0.001, 0.0), WORDLESS)  # type: ignore[arg-type]
    assert record.mode == mode
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.015)
    assert any("nothing in the file says it" in sentence for sentence in record.assumed)


def test_a_curve_that_does_not_tell_its_mode_is_asked_for(tmp_path: Path) -> None:
    strain = np.linspace(0, 0.15, 40)
    with pytest.raises(
        InputError, match=r"whether the test pulled or pushed; add --mode tension or --mode comp"
    ):
        read(tmp_path, strain, 30 * strain, names=WORDLESS)
    assert (
        read(tmp_path, strain, 30 * strain, names=WORDLESS, stated=Stated(mode="compression")).mode
        == "compression"
    )


@pytest.mark.parametrize("signs", [(1, 1), (-1, -1), (-1, 1), (1, -1)])
@pytest.mark.parametrize(
    "names",
    ["Compressive strain (-),Stress (kPa)", "Stauchung (-),Druckspannung (kPa)", f"Compression test\n{WORDLESS}",
     f"Prüfart;Druckversuch\n{WORDLESS}", f"Standard: ISO 7743\n{WORDLESS}",
     "Compression (-),Compressive stress (kPa)"],
)  # fmt: skip
def test_words_tell_a_compression_whatever_its_signs(
    names: str, signs: tuple[int, int], tmp_path: Path
) -> None:
    strain = np.linspace(0, 0.4, 80)
    record = read(tmp_path, signs[0] * strain, signs[1] * neo_hookean_kPa(strain, "compression"), names=names)
    assert record.mode == "compression"
    assert record.strain.min() == pytest.approx(-0.4)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


def test_a_height_that_falls_tells_a_compression(tmp_path: Path) -> None:
    strain = np.linspace(0, 0.4, 80)
    height, load = 20 * (1 - strain), neo_hookean_kPa(strain, "compression") * 0.5
    record = read(tmp_path, height, load, names="Height (mm),Load (N)", stated=Stated(area=5e-4))
    assert record.mode == "compression"
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


def test_a_compression_beyond_the_specimen_is_refused(tmp_path: Path) -> None:
    strain = np.linspace(0, 1.2, 80)
    with pytest.raises(InputError, match=r"nothing is left of the specimen"):
        read(tmp_path, strain, pulled(strain), names="Compressive strain (-),Stress (kPa)")
