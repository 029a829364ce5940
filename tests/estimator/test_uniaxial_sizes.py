"""The specimen's sizes as files state them: tubes, lengths between grips and of extensometers, several specimens."""

import math
from pathlib import Path

import pytest
from gel_records import PULLED, modulus, read, table

from daq.bad_input.samples.machine_exports import YOUNGS_MODULUS
from estimator.errors import InputError
from estimator.uniaxial import Stated

NAMES = "Time (s),Extension (mm),Load (N)"
BAR = "Length,20,mm\nWidth,10,mm\nThickness,2,mm\n\n"


def travelled(names: str = NAMES, load: float = 1.0) -> str:
    return table(names, PULLED.time_s, PULLED.travel_mm, load * PULLED.load_N)


TUBES = {
    "Outer diameter,10,mm\nInner diameter,8,mm": math.pi / 4 * (10**2 - 8**2),
    "Inner diameter,8,mm\nOuter diameter,10,mm": math.pi / 4 * (10**2 - 8**2),
    "Außendurchmesser,10,mm\nInnendurchmesser,6,mm": math.pi / 4 * (10**2 - 6**2),
    "Diameter,10,mm\nWall thickness,1,mm": math.pi / 4 * (10**2 - 8**2),
    "Width,10,mm\nWall thickness,2,mm": 20.0,
    "Diameter,10,mm\nThickness,3,mm": math.pi / 4 * 10**2,
}


@pytest.mark.parametrize("sizes", TUBES)
def test_the_cross_section_of_a_tube_is_a_ring(sizes: str, tmp_path: Path) -> None:
    text = f"Length,20,mm\n{sizes}\n\n" + travelled(load=TUBES[sizes] / 20.0)
    assert modulus(read(tmp_path, text)) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize("length", ["Extensometer gauge length,8,mm", "Gauge length (extensometer),8,mm"])
@pytest.mark.parametrize("first", [True, False])
def test_travel_of_the_crosshead_is_not_spread_over_the_length_of_an_extensometer(
    length: str, first: bool, tmp_path: Path
) -> None:
    lines = [length, "Grip separation,20,mm"] if first else ["Grip separation,20,mm", length]
    facts = "\n".join([*lines, "Area,20,mm2", "", ""])
    assert modulus(read(tmp_path, facts + travelled())) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)
    on_specimen = table(
        "Time (s),Extensometer (mm),Load (N)", PULLED.time_s, 8 * PULLED.strain, PULLED.load_N
    )
    assert modulus(read(tmp_path, facts + on_specimen)) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)
    alone = f"{length}\nArea,20,mm2\n\n"
    with pytest.raises(InputError, match="strain from travel needs the gauge length"):
        read(tmp_path, alone + travelled())


def test_of_two_lengths_that_travel_may_be_spread_over_the_right_one_is_asked_for(tmp_path: Path) -> None:
    text = "Gauge length,10,mm\nGrip separation,20,mm\nArea,20,mm2\n\n" + travelled()
    with pytest.raises(
        InputError, match="'Gauge length 10 mm' or 'Grip separation 20 mm'; add --gauge-length"
    ):
        read(tmp_path, text)
    assert modulus(read(tmp_path, text, Stated(gauge_length=0.02))) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


SIDES = {
    "a column each": "Specimen;1;2\nLength (mm);20;20\nWidth (mm);10;20\nThickness (mm);2;2\n\n",
    "unit first": "Specimen;1;2\nLength;mm;20;20\nWidth;mm;10;20\nThickness;mm;2;2\n\n",
    "unit last": ";A;B\nLength;20;20;mm\nWidth;10;20;mm\nThickness;2;2;mm\n\n",
    "above its own columns": "Length;20;mm;Length;20;mm\nWidth;10;mm;Width;20;mm\nThickness;2;mm;Thickness;2;mm\n",
    "a row each": "Specimen;Length (mm);Width (mm);Thickness (mm)\n1;20;10;2\n2;20;20;2\n\n",
}


@pytest.mark.parametrize("which", ["1", "2"])
@pytest.mark.parametrize("form", SIDES)
def test_each_of_specimens_beside_each_other_has_its_own_sizes(form: str, which: str, tmp_path: Path) -> None:
    one = (PULLED.time_s, PULLED.travel_mm)
    rows = table(f"{NAMES},{NAMES}", *one, PULLED.load_N, *one, 2 * PULLED.load_N)
    record = read(tmp_path, SIDES[form] + rows.replace(",", ";"), Stated(specimen=which))
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize("unit", ["mm", "cm", "in", "in.", "inch", '"', "µm"])
def test_lengths_are_understood_in_every_unit(unit: str, tmp_path: Path) -> None:
    per_mm = {"mm": 1.0, "cm": 0.1, "µm": 1e3}.get(unit, 1 / 25.4)
    facts = f"Gauge length;{20 * per_mm:.8f} {unit}\nArea;20 mm2\n\n"
    assert modulus(read(tmp_path, facts + travelled().replace(",", ";"))) == pytest.approx(
        YOUNGS_MODULUS, rel=1e-3
    )


@pytest.mark.parametrize("unit", ["in^2", "in²", "sq in", "sq. in.", "sq.in"])
def test_areas_are_understood_in_every_unit(unit: str, tmp_path: Path) -> None:
    facts = f"Length,20 mm\nArea,{20 / 645.16:.8f} {unit}\n\n"
    assert modulus(read(tmp_path, facts + travelled())) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize("size", ["10,000", "2,000"])
def test_a_size_that_may_be_thousands_is_refused(size: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=rf"line 2: .{size}. of .Width. may have a decimal mark"):
        read(
            tmp_path, f"Length;20.0;mm\nWidth;{size};mm\nThickness;2.0;mm\n\n" + travelled().replace(",", ";")
        )
