"""Records of tensile and compression tests: recognised by content, read to SI, refused with clear words."""

from pathlib import Path

import numpy as np
import pytest

from estimator.errors import InputError
from estimator.uniaxial import read_record

DATA = Path(__file__).parents[1] / "data" / "uniaxial"
TABLE = "strain,stress (kPa)\n" + "".join(f"{0.1 * i:.1f},{4 * i}\n" for i in range(1, 9))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "specimen 7.csv"


def test_a_tensile_test_of_the_soft_robotics_database_reads_in_si() -> None:
    record = read_record(DATA / "ecoflex_00-30_tension.csv")
    assert record.mode == "tension"
    assert (record.strain[0], record.stress[0]) == (0.06795, pytest.approx(1490.0))
    assert record.strain[-1] == pytest.approx(2.0)
    assert record.facts["Speed (mm/min)"] == "450"
    assert not {"PARAMETER", "Time (s)"} & set(record.facts)
    assert record.strain_from_crosshead
    assert record.shape_factor is None


def test_a_compression_test_of_the_phantom_database_reads_in_si() -> None:
    record = read_record(DATA / "ef30_0t_a1_compression.csv")
    assert record.mode == "compression"
    assert (record.strain[2], record.stress[2]) == (-0.010997, pytest.approx(-837.98))
    assert record.facts["Load cell"] == "10kN"
    assert not {"Compression test", "Time (s)"} & set(record.facts)
    assert record.shape_factor == pytest.approx(50 / (4 * 30))
    assert not record.strain_from_crosshead


@pytest.mark.parametrize(
    "text",
    [
        TABLE,
        TABLE.replace(",", ";"),
        TABLE.replace(",", "\t"),
        TABLE.replace(",", ";").replace("0.", "0,"),
        TABLE.replace("strain,stress (kPa)", "Strain [-],Nominal Stress_kPa"),
        TABLE.replace("strain,stress (kPa)", "number of the test: 7\n\nstrain,stress in kPa"),
    ],
    ids=["commas", "semicolons", "tabs", "decimal commas", "other titles", "lines above"],
)
def test_a_bare_table_of_two_columns_reads(file: Path, text: str) -> None:
    file.write_text(text)
    record = read_record(file)
    assert record.name == "specimen 7"
    np.testing.assert_allclose(record.strain, np.arange(1, 9) / 10)
    np.testing.assert_allclose(record.stress, 4e3 * np.arange(1, 9))


def test_percent_and_pascal_are_understood(file: Path) -> None:
    file.write_text("Strain (%),Stress (Pa)\n" + "".join(f"{10 * i},{4000 * i}\n" for i in range(1, 9)))
    record = read_record(file)
    assert record.strain[-1] == pytest.approx(0.8)
    assert record.stress[-1] == 32_000.0


def test_a_table_without_titles_is_refused(file: Path) -> None:
    file.write_text("\n".join(f"{0.1 * i},{4000 * i}" for i in range(1, 9)))
    with pytest.raises(InputError, match=r"no line names a strain and a stress column"):
        read_record(file)


def test_only_the_first_loading_is_kept(file: Path) -> None:
    file.write_text(TABLE + "0.5,18\n0.2,7\n")
    assert read_record(file).strain.max() == read_record(file).strain[-1] == 0.8


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"no line names a strain and a stress column"),
        (
            "hello\nworld\n",
            r"no line names a strain and a stress column.*write 'strain \(-\),stress \(kPa\)'",
        ),
        (TABLE.replace(" (kPa)", ""), r"line 1: 'stress' has no unit; add --stress-unit"),
        (
            TABLE.replace("(kPa)", "(fur)"),
            r"line 1: the unit of 'stress \(fur\)' \(fur\) is none of Pa, kPa, MPa",
        ),
        (
            TABLE.replace("stress", "true stress"),
            r"line 1: only true stress \('true stress \(kPa\)'\); give engineering stress",
        ),
        (TABLE.replace("0.3,12", "0.3,twelve"), r"line 4, field 2: 'twelve' is no number"),
        (TABLE.replace("0.3,12", "0.3,nan"), r"line 4, field 2: 'nan' is no number"),
        (TABLE.replace("0.3,12", "0.3"), r"line 4: field 2 \(stress \(kPa\)\) is empty; complete the row"),
        (TABLE.replace("0.3,12", "0,3,12"), r"line 4: 3 fields, and 2 names above them; if the comma"),
        (TABLE[:46], r"4 rows; at least 6 are needed"),
        (
            TABLE.replace("strain,", "strain (-),").replace("0.8,", "80,"),
            r"reaches 80 times the length.*check its unit",
        ),
        (TABLE.replace("0.", ""), r"'strain' has no unit and reaches 8, which may be .*add --strain-unit"),
        (
            TABLE.replace("(kPa)", "(GPa)").replace("strain", "tensile strain"),
            r"stress over strain is 4e\+10 Pa",
        ),
    ],
)
def test_what_is_no_record_is_refused_in_one_line(file: Path, text: str, message: str) -> None:
    file.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_record(file)
    assert str(caught.value).startswith(str(file))
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.csv: there is no such file"):
        read_record(tmp_path / "none.csv")
    with pytest.raises(InputError, match="is a folder"):
        read_record(tmp_path)
