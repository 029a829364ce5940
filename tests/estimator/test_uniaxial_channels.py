"""Which of several channels of a test is read: axes of a sensor, multiples, channels that do not count."""

from pathlib import Path

import numpy as np
import pytest
from gel_records import PULLED, modulus, read, table

from daq.bad_input.samples.machine_exports import YOUNGS_MODULUS
from estimator.errors import InputError
from estimator.uniaxial import Stated

BAR = Stated(gauge_length=0.02, area=2e-5, mode="tension")
AXES = ["Fx (N),Fy (N),Fz (N)", "Force X (N),Force Y (N),Force Z (N)", "XForce_N,YForce_N,ZForce_N"]


@pytest.mark.parametrize("loaded", range(3))
@pytest.mark.parametrize("names", AXES)
def test_of_a_sensor_of_several_axes_the_loaded_one_is_read(names: str, loaded: int, tmp_path: Path) -> None:
    shares = [0.05, -0.03, 0.04]
    shares[loaded] = 1.0
    text = table(f"Extension (mm),{names}", PULLED.travel_mm, *(share * PULLED.load_N for share in shares))
    record = read(tmp_path, text, BAR)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)
    assert any(repr(names.split(",")[loaded]) in sentence for sentence in record.found)


@pytest.mark.parametrize("names", ["exx,eyy,exy", "eyy,exx,exy", "Strain X (-),Strain Y (-),Strain XY (-)"])
@pytest.mark.parametrize("along_first", [True, False])
def test_of_strains_along_several_axes_the_largest_is_read(
    names: str, along_first: bool, tmp_path: Path
) -> None:
    across = (1 + PULLED.strain) ** -0.5 - 1
    strains = (PULLED.strain, across) if along_first else (across, PULLED.strain)
    text = table(f"{names},Stress (kPa)", *strains, 0 * across, PULLED.stress)
    assert modulus(read(tmp_path, text, BAR)) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


def test_a_column_of_the_specimens_size_gives_the_length_that_travel_is_spread_over(tmp_path: Path) -> None:
    names = "SetName,Cycle,Time_S,Size_mm,Displacement_mm,Force_N"
    rows = zip(PULLED.time_s, 20 + PULLED.travel_mm, PULLED.travel_mm, PULLED.load_N, strict=True)
    lines = [f"1-Stretch,1,{t:.2f},{size:.5f},{travel:.5f},{load:.6f}" for t, size, travel, load in rows]
    record = read(tmp_path, "\n".join([names, *lines]), Stated(area=2e-5, mode="tension"))
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize("share", [0.4, 1.0, -0.7])
def test_a_test_that_loads_two_axes_is_no_uniaxial_one(share: float, tmp_path: Path) -> None:
    names = "XDisplacement_mm,YDisplacement_mm,XForce_N,YForce_N"
    text = table(names, PULLED.travel_mm, PULLED.travel_mm, PULLED.load_N, share * PULLED.load_N)
    with pytest.raises(InputError, match=r"line 1: .* loaded along two axes; a uniaxial test has one"):
        read(tmp_path, text, BAR)


def test_noise_along_the_other_axes_is_no_load(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    noise = 0.08 * PULLED.load_N.max() * rng.normal(size=(3, len(PULLED.load_N)))
    text = table(
        "Extension (mm),Fx (N),Fy (N),Fz (N)", PULLED.travel_mm, *noise[:2], PULLED.load_N + noise[2]
    )
    assert modulus(read(tmp_path, text, BAR)) == pytest.approx(YOUNGS_MODULUS, rel=0.1)


@pytest.mark.parametrize("names", ["Strain *1000,Stress (kPa)", "Strain (x10^-3),Stress (kPa)"])
def test_a_multiple_in_the_name_of_a_strain_is_refused(names: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"line 1: the unit of .*10.* is none of -, %.*convert it"):
        read(tmp_path, table(names, 1e3 * PULLED.strain, PULLED.stress), BAR)


@pytest.mark.parametrize(
    "name", ["Load (N) x10", "Load x 10 (N)", "Load [N x 10⁻¹]", "Load (N)/10", "Load (N × 1e-3)"]
)
def test_a_multiple_in_the_name_of_a_load_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"line 1: the unit of .*convert it"):
        read(tmp_path, table(f"Strain (-),{name}", PULLED.strain, PULLED.load_N), BAR)


NOISE = 2e-3 * np.random.default_rng(3).normal(size=len(PULLED.stress))


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize("reading", [0.0, 19.0, -9.9])
@pytest.mark.parametrize("rows", [(20,), (10, 30, 35)])
@pytest.mark.parametrize("column", ["strain", "stress"])
def test_single_readings_far_from_those_beside_them_are_left_out_and_told(
    column: str, rows: tuple[int, ...], reading: float, noise: float, tmp_path: Path
) -> None:
    strain, stress = PULLED.strain.copy(), PULLED.stress + noise * NOISE * PULLED.stress.max()
    {"strain": strain, "stress": stress}[column][list(rows)] = reading
    record = read(tmp_path, table("Strain (-),Stress (kPa)", strain, stress), BAR)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=2e-2 if noise else 1e-3)
    assert len(record.strain) == len(strain) - len(rows)
    assert record.left_out[0].startswith(f"line {rows[0] + 2}")
    assert record.left_out[0].endswith("a single reading far from those beside it")


@pytest.mark.parametrize("limit", [0.3, 0.5, 0.8])
def test_what_a_load_cell_reads_at_its_limit_is_left_out_and_told(limit: float, tmp_path: Path) -> None:
    clipped = np.minimum(PULLED.stress, limit * PULLED.stress.max())
    record = read(tmp_path, table("Strain (-),Stress (kPa)", PULLED.strain, clipped), BAR)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)
    assert "the load cell is at its limit" in record.left_out[0]


@pytest.mark.parametrize("digits", [1, 2])
@pytest.mark.parametrize("repeated", [1, 5])
def test_coarse_and_repeated_readings_are_neither_odd_nor_at_a_limit(
    digits: int, repeated: int, tmp_path: Path
) -> None:
    strain, stress = (np.repeat(column, repeated) for column in (PULLED.strain, PULLED.stress))
    record = read(tmp_path, table("Strain (-),Stress (kPa)", strain, np.round(stress, digits)), BAR)
    assert record.left_out == ()
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.02)


SET = {
    "Strain setpoint (-),Strain (-),Stress (kPa)": (1.2, 1.0),
    "Target position (mm),Position (mm),Load (N)": (24.0, 20.0),
    "Commanded displacement (mm),Actual displacement (mm),Load (N)": (24.0, 20.0),
    "Sollwert Weg (mm),Weg (mm),Kraft (N)": (24.0, 20.0),
    "Strain std (-),Strain (-),Stress (kPa)": (0.1, 1.0),
    "Displacement (mm),Corrected displacement (mm),Load (N)": (24.0, 20.0),
}


@pytest.mark.parametrize("names", SET)
def test_what_was_measured_is_read_and_not_what_was_asked_for_or_its_scatter(
    names: str, tmp_path: Path
) -> None:
    first, second = SET[names]
    load = PULLED.load_N if "(N)" in names else PULLED.stress
    record = read(tmp_path, table(names, first * PULLED.strain, second * PULLED.strain, load), BAR)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


def test_the_scatter_of_a_mean_curve_is_no_stress(tmp_path: Path) -> None:
    text = table(
        "Strain (-),Mean stress (kPa),SD stress (kPa)", PULLED.strain, PULLED.stress, PULLED.stress / 100
    )
    with pytest.raises(InputError, match="or none as stress or load"):
        read(tmp_path, text, BAR)


@pytest.mark.parametrize("raw", ["Force (V)", "Raw force (counts)"])
def test_a_force_is_read_and_not_the_signal_beside_it(raw: str, tmp_path: Path) -> None:
    text = table(f"Extension (mm),{raw},Force (N)", PULLED.travel_mm, 300 * PULLED.load_N, PULLED.load_N)
    assert modulus(read(tmp_path, text, BAR)) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize(
    "names",
    ["Wegaufnehmer (mm);Kraftaufnehmer (N)", "Carrera (mm);Fuerza (N)", "Traversenposition (mm);Kraft (N)"],
)
def test_other_words_for_travel_and_load_are_known(names: str, tmp_path: Path) -> None:
    text = table(names, PULLED.travel_mm, PULLED.load_N, separator=";")
    assert modulus(read(tmp_path, text, BAR)) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)
