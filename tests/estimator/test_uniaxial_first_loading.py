"""What of a test is its first loading, where its zeros lie, and whether it pulled or pushed."""

from collections.abc import Callable
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


def bent(strain: FloatArray, width: float) -> FloatArray:
    """Return strain of a specimen that straightens around zero over a width of strain."""
    return np.asarray(width * np.logaddexp(0.0, strain / width))


@pytest.mark.parametrize("share_of_noise", [0.0, 0.002, 0.005])
@pytest.mark.parametrize("width", [0.003, 0.006, 0.01])
@pytest.mark.parametrize("slack", [0.02, 0.05, 0.1])
def test_slack_that_ends_in_a_soft_bend_is_taken_off(
    slack: float, width: float, share_of_noise: float, tmp_path: Path
) -> None:
    strain = ramp(0, 0.8 + slack, 200)
    record = read(tmp_path, strain, pulled(bent(strain - slack, width)), (share_of_noise, 0.0))
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.04)
    assert any("slack" in sentence for sentence in record.left_out)


@pytest.mark.parametrize("share_of_noise", [0.0, 0.002])
@pytest.mark.parametrize("reach", [0.1, 0.3, 0.6])
@pytest.mark.parametrize("growth", [2.0, 4.0, 8.0])
def test_a_material_that_begins_softly_and_stiffens_is_left_as_it_is(
    growth: float, reach: float, share_of_noise: float, tmp_path: Path
) -> None:
    strain = ramp(0, reach, 150)
    record = read(tmp_path, strain, 10 * np.expm1(growth * strain), (share_of_noise, 0.0))
    assert record.assumed == ()
    assert record.left_out == ()


@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize("first", [-0.35, 0.15, 0.6])
def test_travel_that_counts_from_anywhere_begins_where_no_load_is_borne(
    first: float, noise: tuple[float, float], tmp_path: Path
) -> None:
    strain = ramp(0, 0.8, 100)
    record = read(tmp_path, first + strain, pulled(strain), noise)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.02)
    assert any("zero strain lies there" in sentence for sentence in record.assumed)


@pytest.mark.parametrize("noise", NOISE)
def test_a_record_that_begins_later_keeps_its_strain(noise: tuple[float, float], tmp_path: Path) -> None:
    strain = ramp(0.1, 0.8, 100)
    record = read(tmp_path, strain, pulled(strain), noise)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.02)
    assert record.assumed == ()


@pytest.mark.parametrize("height", [0.02, None])
@pytest.mark.parametrize("gap", [0.05, 0.2])
def test_plates_that_come_to_a_specimen_bear_nothing_before_and_meet_at_its_height(
    gap: float, height: float | None, tmp_path: Path
) -> None:
    strain = ramp(-gap, 0.4, 150)
    load = neo_hookean_kPa(np.maximum(strain, 0.0), "compression") * 0.5
    stated = Stated(area=5e-4, gauge_length=height)
    record = read(tmp_path, 20 * (1 - strain), load, (0.002, 0.0), "Gap (mm),Load (N)", stated)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.02)
    assert np.abs(record.strain).min() < 0.02


@pytest.mark.parametrize(
    "before",
    [
        0.004 * np.random.default_rng(1).standard_normal(30),
        np.concatenate([ramp(0, -0.03, 10), ramp(-0.03, 0, 10)]),
        np.concatenate([ramp(0, 0.01, 4), ramp(0.01, 0, 4)] * 3),
    ],
    ids=["trembling", "the other way", "to and fro"],
)
def test_a_test_that_first_goes_to_and_fro_is_read_from_where_it_goes_off(
    before: FloatArray, tmp_path: Path
) -> None:
    strain = np.concatenate([before, ramp(0, 0.8, 200)])
    record = read(tmp_path, strain, pulled(strain), (0.002, 0.0))
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.015)
    assert record.strain.max() > 0.78
    assert any("before the test moves off" in sentence for sentence in record.left_out)


@pytest.mark.parametrize("size", [0.5, 1.0])
def test_noise_at_the_start_is_no_tear(size: float, tmp_path: Path) -> None:
    strain = ramp(0, 0.8, 200)
    stress = pulled(strain)
    stress[:5] += size * np.array([1.0, -1.2, 0.8, -0.6, 0.4])
    record = read(tmp_path, strain, stress, (0.002, 0.0))
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.015)
    assert record.strain.max() > 0.78


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


FOAMS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "plateau": lambda strain: 5 * np.tanh(strain / 0.06) + 0.3 * strain,
    "hyperfoam": lambda strain: np.abs((1 - strain) ** 7 - 1 / (1 - strain)),
    "soft hyperfoam": lambda strain: np.abs((1 - strain) - 1 / (1 - strain)),
    "straight": lambda strain: 20 * strain,
}
TISSUES: dict[str, Callable[[FloatArray], FloatArray]] = {
    "exponential": lambda strain: np.expm1(8 * strain),
    "slower exponential": lambda strain: np.expm1(4 * strain),
    "Ogden": lambda strain: (1 + strain) ** 8 - (1 + strain) ** -5.5,
}


@pytest.mark.parametrize("reach", [0.2, 0.3, 0.4])
@pytest.mark.parametrize("material", [*FOAMS, *TISSUES])
def test_a_curve_that_either_mode_may_have_is_asked_for(material: str, reach: float, tmp_path: Path) -> None:
    strain = np.linspace(0, reach, 100)
    stress = {**FOAMS, **TISSUES}[material](strain)
    with pytest.raises(InputError, match=r"nothing tells whether the test pulled or pushed; add --mode"):
        read(tmp_path, strain, stress, (0.001, 0.0), WORDLESS)


@pytest.mark.parametrize("reach", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("stiffening", [0.0, 0.1, 0.3])
def test_a_solid_that_stiffens_far_out_bends_as_in_tension_at_first(
    stiffening: float, reach: float, tmp_path: Path
) -> None:
    strain = np.linspace(0, reach, 120)
    stretch = 1 + strain
    law = 1 + stiffening * (stretch**2 + 2 / stretch - 3)
    assert read(tmp_path, strain, law * pulled(strain), (0.001, 0.0), WORDLESS).mode == "tension"


@pytest.mark.parametrize(
    ("name", "mode"),
    [("gel_compression_2", "compression"), ("Druckversuch 3", "compression"), ("tensile-01", "tension")],
)
def test_a_name_tells_the_mode_where_nothing_else_does(name: str, mode: str, tmp_path: Path) -> None:
    strain = np.linspace(0, 0.3, 60)
    file = tmp_path / f"{name}.csv"
    rows = (f"{e:.6f},{20 * e:.6f}" for e in strain)
    file.write_text("\n".join([WORDLESS, *rows]))
    record = read_record(file)
    assert record.mode == mode
    assert any(f"the name {name!r}" in sentence for sentence in record.assumed)


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
