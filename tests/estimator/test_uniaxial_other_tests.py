"""Files of other measures than engineering strain and stress, and of tests that neither pull nor push."""

from pathlib import Path

import pytest
from gel_records import PULLED, modulus, read, table

from daq.bad_input.samples.machine_exports import YOUNGS_MODULUS
from estimator.errors import InputError
from estimator.uniaxial import Stated


@pytest.mark.parametrize(
    ("names", "wanted"),
    [
        ("Green strain,Stress (kPa)", r"only Green strain .*sqrt\(1 \+ 2 Green strain\) - 1"),
        ("Lagrangian strain E11,Stress (kPa)", "only Green strain"),
        ("Almansi strain (-),Stress (kPa)", "only Almansi strain"),
        ("Natural strain,Stress (kPa)", r"only true strain .*exp\(true strain\) - 1"),
        ("Strain (-),2nd Piola-Kirchhoff stress (kPa)", r"only second Piola-Kirchhoff stress .*times \(1 \+"),
        ("Strain (-),PK2 stress (kPa)", "only second Piola-Kirchhoff stress"),
        ("Strain (-),Kirchhoff stress (kPa)", "only Kirchhoff stress"),
    ],
)
def test_other_measures_of_strain_and_stress_are_refused_with_their_conversion(
    names: str, wanted: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=f"line 1: {wanted}"):
        read(tmp_path, table(names, PULLED.strain, PULLED.stress), Stated(mode="tension"))


@pytest.mark.parametrize(
    "name", ["1st Piola-Kirchhoff stress (kPa)", "First PK stress (kPa)", "PK1 stress (kPa)"]
)
def test_the_first_piola_kirchhoff_stress_is_the_engineering_one(name: str, tmp_path: Path) -> None:
    record = read(tmp_path, table(f"Strain (-),{name}", PULLED.strain, PULLED.stress), Stated(mode="tension"))
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


NOT_UNIAXIAL = {
    "shear": ("Shear strain (-),Shear stress (kPa)", "Test type,Simple shear", "gel_shear_1"),
    "bending": ("Flexure strain (-),Flexure stress (kPa)", "Method,3-point bending", "gel_bend_2"),
    "biaxial": ("Strain (-),Equibiaxial stress (kPa)", "Test,Biaxial tension", "biaxial"),
    "planar": ("Planar strain (-),Stress (kPa)", "Test type,Planar tension", "planar_tension"),
    "oscillation": ("Oscillation strain (-),Oscillation stress (kPa)", "Mode,Oscillation", "oscillation_3"),
    "volumetric": ("Volumetric strain (-),Stress (kPa)", "Test,Confined compression", "confined"),
}


@pytest.mark.parametrize("kind", NOT_UNIAXIAL)
def test_a_test_that_neither_pulls_nor_pushes_is_refused_with_what_tells_it(
    kind: str, tmp_path: Path
) -> None:
    titles, line, name = NOT_UNIAXIAL[kind]
    numbers = table("", PULLED.strain, PULLED.stress)
    plain = f"Strain (-),Stress (kPa){numbers}"
    with pytest.raises(InputError, match=rf"the line .* tells a {kind} test.*add --mode"):
        read(tmp_path, f"{line}\n\n{plain}")
    with pytest.raises(InputError, match=rf"the name '{name}' tells a {kind} test"):
        read(tmp_path, plain, name=f"{name}.csv")
    for stated in (Stated(), Stated(mode="tension")):
        with pytest.raises(
            InputError, match=rf"the column .* tells a {kind} test.*name the column otherwise"
        ):
            read(tmp_path, titles + numbers, stated)
    outranked = read(tmp_path, f"{line}\n\n{plain}", Stated(mode="tension"), name=f"{name}.csv")
    assert modulus(outranked) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize("fact", ["Shear modulus,10,kPa", "Test,Unconfined tension", "Number of bends,0"])
def test_words_of_other_tests_that_are_not_of_this_one_are_passed_over(fact: str, tmp_path: Path) -> None:
    text = f"{fact}\n\n" + table("Strain (-),Stress (kPa)", PULLED.strain, PULLED.stress)
    assert modulus(read(tmp_path, text)) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)
