"""Which of several channels of a test is read: axes of a sensor, multiples, channels that do not count."""

from pathlib import Path

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
