"""Exports of testing machines in every layout, language, encoding and unit: one gel, one modulus, or one clear line."""

from pathlib import Path

import numpy as np
import openpyxl
import pytest
from gel_records import PULLED, modulus, read, table
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.bad_input.samples.machine_exports import (
    TEXT_LAYOUTS,
    YOUNGS_MODULUS,
    GelTest,
    bluehill,
    gel_test,
    workbook,
    zwick_testxpert,
)
from estimator.errors import InputError
from estimator.uniaxial import Stated, read_record

MODES = ("tension", "compression")


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["positive", "negative"])
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("layout", TEXT_LAYOUTS)
def test_every_layout_gives_the_modulus_and_the_mode(
    layout: str, mode: str, sign: float, tmp_path: Path
) -> None:
    test = gel_test(mode, compression_sign=sign, noise=1e-3)  # type: ignore[arg-type]
    record = read(tmp_path, TEXT_LAYOUTS[layout](test))
    assert record.mode == mode
    assert record.mode_from
    assert record.left_out == ()
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=0.01)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])
def test_every_encoding_is_read(encoding: str, end: str, tmp_path: Path) -> None:
    record = read(tmp_path, zwick_testxpert(PULLED).replace("\n", end).encode(encoding))
    assert record.facts["Prüfer"] == "Meier"
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize(
    ("separator", "decimal"), [("\t", ","), (";", ","), (";", "."), ("\t", "."), ("|", ","), ("  ", ",")]
)
@settings(deadline=None, derandomize=True, max_examples=15)
@given(digits=st.integers(4, 9), leading=st.integers(0, 3))
def test_separator_and_decimal_mark_are_settled_by_the_file(
    separator: str, decimal: str, digits: int, leading: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    others = [PULLED.time_s] * leading
    names = separator.join([*(f"t{i}(s)" for i in range(leading)), "Dehnung(-)", "Zugspannung(kPa)"])
    text = table(
        names, *others, PULLED.strain, PULLED.stress, separator=separator, decimal=decimal, digits=digits
    )
    record = read(tmp_path_factory.mktemp("layout"), text)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


def test_quoted_decimal_commas_between_commas_are_read(tmp_path: Path) -> None:
    record = read(tmp_path, bluehill(PULLED, decimal=","))
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize(
    ("thousands", "decimal"), [(",", "."), (".", ","), (" ", ","), ("\u00a0", ","), ("'", ".")]
)
def test_groups_of_thousands_are_understood(thousands: str, decimal: str, tmp_path: Path) -> None:
    def written(value: float) -> str:
        return f"{value:,.3f}".replace(",", "x").replace(".", decimal).replace("x", thousands)

    rows = [
        f"{100 * e:.4f}".replace(".", decimal) + f";{written(1e3 * s)}"
        for e, s in zip(PULLED.strain, PULLED.stress, strict=True)
    ]
    record = read(tmp_path, "\n".join(["Strain (%);Stress (Pa)", *rows]))
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


def test_what_may_be_thousands_is_asked_for(tmp_path: Path) -> None:
    rows = [
        f"{100 * e:.4f};{round(1e3 * s):,}".replace(",", ".")
        for e, s in zip(PULLED.strain, PULLED.stress, strict=True)
    ]
    with pytest.raises(
        InputError, match=r"may have a decimal point or a point between thousands; add --decimal"
    ):
        read(tmp_path, "\n".join(["Strain (%);Stress (Pa)", *rows]))


def test_numbers_written_both_ways_are_refused_with_the_line(tmp_path: Path) -> None:
    commas = table("Strain (-);Stress (kPa)", PULLED.strain, PULLED.stress, separator=";", decimal=",")
    lines = commas.split("\n")
    lines[40] = lines[40].replace(",", ".")
    with pytest.raises(InputError, match=r"line 41: .* has a decimal point, and .* \(line 2\) has not"):
        read(tmp_path, "\n".join(lines))


@pytest.mark.parametrize(
    ("unit", "per_kPa"),
    [("Pa", 1e3), ("kPa", 1.0), ("KPa", 1.0), ("MPa", 1e-3), ("N/mm²", 1e-3), ("N/mm^2", 1e-3), ("kN/m2", 1.0),
     ("psi", 1 / 6.894757293), ("bar", 0.01)],
)  # fmt: skip
@pytest.mark.parametrize(
    "name", ["Stress ({})", "Tensile stress [{}]", "σ / {}", "Spannung {}", "stress in {}"]
)
def test_every_way_to_write_a_unit_is_understood(
    name: str, unit: str, per_kPa: float, tmp_path: Path
) -> None:
    names = f"Strain (%);{name.format(unit)}"
    text = table(names, 100 * PULLED.strain, per_kPa * PULLED.stress, separator=";", digits=9)
    assert modulus(read(tmp_path, text)) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize(
    ("names", "columns", "asked"),
    [
        ("Strain (-),Stress", ("strain", "stress"), "--stress-unit"),
        ("Strain,Stress (kPa)", ("ten", "stress"), "--strain-unit"),
        ("Extension (mm),Load", ("travel_mm", "load_N"), "--force-unit"),
        ("Extension,Load (N)", ("travel_mm", "load_N"), "--length-unit"),
        ("Extension (mm),Load (N)", ("travel_mm", "load_N"), "--gauge-length"),
    ],
)
def test_what_is_missing_is_asked_for(
    names: str, columns: tuple[str, str], asked: str, tmp_path: Path
) -> None:
    values = [10 * PULLED.strain if name == "ten" else getattr(PULLED, name) for name in columns]
    with pytest.raises(InputError, match=rf"add {asked}") as caught:
        read(
            tmp_path,
            table(names, *values),
            None if "gauge" in asked else Stated(gauge_length=0.02, area=2e-5),
        )
    assert "\n" not in str(caught.value)


def test_what_the_user_states_is_used(tmp_path: Path) -> None:
    text = table("Extension,Load", PULLED.travel_mm, PULLED.load_N)
    stated = Stated(length_unit="mm", force_unit="N", gauge_length=0.02, width=0.01, thickness=0.002)
    assert modulus(read(tmp_path, text, stated)) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


def test_a_unit_that_the_file_contradicts_is_refused(tmp_path: Path) -> None:
    text = table("Strain (-),Stress (Pa)", PULLED.strain, PULLED.stress)
    with pytest.raises(InputError, match=r"is in Pa, and --stress-unit says kPa"):
        read(tmp_path, text, Stated(stress_unit="kPa"))


@pytest.mark.parametrize(("factor", "word"), [(1.0, "a fraction"), (100.0, "a percentage")])
def test_the_unit_of_a_strain_that_can_be_only_one_is_supposed_and_told(
    factor: float, word: str, tmp_path: Path
) -> None:
    record = read(tmp_path, table("Strain,Stress (kPa)", factor * PULLED.strain, PULLED.stress))
    assert any(word in sentence for sentence in record.assumed)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


def test_a_stress_without_unit_is_told_by_load_and_area(tmp_path: Path) -> None:
    text = "Area,20,mm2\n" + table("Strain (-),Stress,Load (N)", PULLED.strain, PULLED.stress, PULLED.load_N)
    record = read(tmp_path, text)
    assert any("is taken for kPa: so it is load over area" in sentence for sentence in record.assumed)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


TWICE = GelTest("tension", PULLED.strain, 2 * PULLED.stress)


def below(*tests: GelTest) -> str:
    return "\n".join(
        f"Specimen {i}\n" + table("Tensile strain (-),Stress (kPa)", test.strain, test.stress)
        for i, test in enumerate(tests, start=1)
    )


def beside(*tests: GelTest) -> str:
    names = ",".join(["Strain (-)", "Tensile stress (kPa)"] * len(tests))
    labels = ",,".join(f"1 _ {i}" for i, _ in enumerate(tests, start=1))
    return f"{labels}\n" + table(names, *[column for test in tests for column in (test.strain, test.stress)])


@pytest.mark.parametrize("which", [None, "1", "2"])
@pytest.mark.parametrize("layout", [below, beside])
def test_of_several_specimens_one_is_taken_and_told(
    layout: object, which: str | None, tmp_path: Path
) -> None:
    record = read(tmp_path, layout(PULLED, TWICE), Stated(specimen=which))  # type: ignore[operator]
    assert modulus(record) == pytest.approx((2 if which == "2" else 1) * YOUNGS_MODULUS, rel=1e-3)
    assert record.found[0].startswith(f"specimen {which or 1} of 1")


def test_a_specimen_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"has no specimen '3'; it has 1 \(Specimen 1\), 2 \(Specimen 2\)"):
        read(tmp_path, below(PULLED, TWICE), Stated(specimen="3"))


@pytest.mark.parametrize("as_text", [False, True], ids=["numbers", "text"])
@pytest.mark.parametrize("mode", MODES)
def test_a_spreadsheet_is_read(mode: str, as_text: bool, tmp_path: Path) -> None:
    content = workbook(gel_test(mode), as_text=as_text, specimens=2)  # type: ignore[arg-type]
    assert modulus(read(tmp_path, content, name="t.xlsx")) == pytest.approx(YOUNGS_MODULUS, rel=2e-3)
    second = read(tmp_path, content, Stated(specimen="specimen 2"), "t.xlsx")
    assert modulus(second) == pytest.approx(2 * YOUNGS_MODULUS, rel=2e-3)
    assert second.mode == mode


def test_a_last_row_that_is_cut_is_left_out_and_told(tmp_path: Path) -> None:
    text = table("Time (s),Strain (-),Stress (kPa)", PULLED.time_s, PULLED.strain, PULLED.stress)
    assert read(tmp_path, f"{text}40.5,0.81").left_out == ("line 83: the last row is incomplete",)


@pytest.mark.parametrize("extra", ["9,0.2,4", "0.2,4,9"])
def test_a_row_with_a_field_too_many_is_refused_with_its_line(extra: str, tmp_path: Path) -> None:
    lines = table("Strain (-),Stress (kPa)", PULLED.strain, PULLED.stress).split("\n")
    lines[20] = extra
    with pytest.raises(InputError, match=r"line 21: 3 fields, and 2 names"):
        read(tmp_path, "\n".join(lines))


@pytest.mark.parametrize(
    ("encoding", "above", "names"),
    [
        ("cp932", "試験種類,引張", "時間(sec),変位(mm),試験力(N)"),
        ("gb18030", "试验类型,拉伸试验", "时间(s),位移(mm),力(N)"),
        ("cp949", "시험,인장", "시간(s),변위(mm),하중(N)"),
        ("cp1251", "испытание,растяжение", "время (с),перемещение (мм),нагрузка (Н)"),
        ("cp1250", "Próba rozciągania,1", "Czas (s),Przemieszczenie (mm),Siła (N)"),
        ("cp850", "Prüfart,Zugversuch", "Prüfzeit (s),Längenänderung (mm),Kraft (N)"),
        ("cp1252", "Ensaio,tração", "Tempo (s),Deslocamento (mm),Força (N)"),
        ("utf-8", "Trekproef,1", "Tijd (s),Verplaatsing (mm),Kracht (N)"),
        ("cp1252", "Dragprov,1", "Tid (s),Förskjutning (mm),Kraft (N)"),
        ("cp1252", "Prova,trazione", "Tempo (s),Spostamento (mm),Forza (N)"),
        ("cp1250", "Zkouška,tah", "Čas (s),Posunutí (mm),Síla (N)"),
    ],
)
def test_older_encodings_are_told_by_the_words_that_they_give(
    encoding: str, above: str, names: str, tmp_path: Path
) -> None:
    text = f"{above}\n{table(names, PULLED.time_s, PULLED.travel_mm, PULLED.load_N)}"
    record = read(tmp_path, text.encode(encoding), Stated(gauge_length=0.02, area=2e-5))
    assert record.mode == "tension"
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize("end", [b"", b"\x1a", b"\r\n\x1a\x1a"])
def test_the_mark_of_an_end_of_file_is_no_text(end: bytes, tmp_path: Path) -> None:
    text = table("Strain (-),Tensile stress (kPa)", PULLED.strain, PULLED.stress)
    assert modulus(read(tmp_path, text.encode() + end)) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize("write", ["{:.6E}", "{:.9e}", "{:+.6E}"])
@pytest.mark.parametrize("letter", ["E", "e", "D", "d"])
@pytest.mark.parametrize("decimal", [".", ","])
def test_exponents_of_every_language_are_numbers(
    decimal: str, letter: str, write: str, tmp_path: Path
) -> None:
    rows = (
        "\t".join(write.format(value).upper().replace("E", letter).replace(".", decimal) for value in row)
        for row in zip(PULLED.strain, PULLED.stress, strict=True)
    )
    record = read(tmp_path, "\n".join(["Strain (-)\tTensile stress (kPa)", *rows]))
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize(
    "head",
    [
        "Time        Axial Displacement   Axial Force\ns           mm                   N",
        "Time (s)   Axial Displacement (mm)   Axial Force (N)",
        "# Time (s)  Axial Displacement (mm)  Axial Force (N)",
        "Time Displacement Force\nSec mm N",
        "% Time_s Displacement_mm Force_N",
    ],
)
def test_columns_parted_by_spaces_are_read_whatever_their_names(head: str, tmp_path: Path) -> None:
    rows = table("", PULLED.time_s, PULLED.travel_mm, PULLED.load_N, separator="   ")
    stated = Stated(gauge_length=0.02, area=2e-5, mode="tension")
    assert modulus(read(tmp_path, head + rows, stated)) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


def test_names_that_cannot_be_parted_are_named(tmp_path: Path) -> None:
    rows = table("Axial Displacement Axial Force", PULLED.travel_mm, PULLED.load_N, separator=" ")
    with pytest.raises(InputError, match=r"names 4 columns, and the rows below have 2; part names"):
        read(tmp_path, rows, Stated(gauge_length=0.02, area=2e-5, force_unit="N", length_unit="mm"))


def test_names_that_are_not_known_are_named(tmp_path: Path) -> None:
    text = table("Punto,Carga utile,Ampiezza", PULLED.time_s, PULLED.travel_mm, PULLED.load_N)
    with pytest.raises(InputError, match=r"line 1: the columns are 'Punto', .*, of which none is known as"):
        read(tmp_path, text.replace("Carga utile", "Peso"))


@pytest.mark.parametrize(
    ("unit", "per_N"),
    [("lbF", 1 / 4.4482216152605), ("LBF", 1 / 4.4482216152605), ("KGF", 1 / 9.80665), ("MN", 1e-6)],
)
def test_units_are_known_in_other_capitals_too(unit: str, per_N: float, tmp_path: Path) -> None:
    text = table(f"Tensile extension [MM],Load [{unit}]", PULLED.travel_mm, per_N * PULLED.load_N, digits=12)
    record = read(tmp_path, text, Stated(gauge_length=0.02, area=2e-5))
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize("parts", [2, 3, 5])
@pytest.mark.parametrize("between", ["", "\n", "Data Acquisition\tTimed\n"])
def test_names_that_are_written_again_within_a_test_part_nothing(
    between: str, parts: int, tmp_path: Path
) -> None:
    names = "Time (s)\tTensile strain (-)\tStress (kPa)\n"
    rows = table("", PULLED.time_s, PULLED.strain, PULLED.stress, separator="\t").strip().split("\n")
    size = -(-len(rows) // parts)
    blocks = ["\n".join(rows[begin : begin + size]) for begin in range(0, len(rows), size)]
    record = read(tmp_path, between.join(f"{names}{block}\n" for block in blocks))
    assert len(record.strain) == len(rows)
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)


@pytest.mark.parametrize("totals", ["Maximum,0.8,14.9", "Mean,0.4,7\nStd. dev.,0.2,4\nMinimum,0,0"])
def test_totals_below_a_table_are_no_rows_of_it(totals: str, tmp_path: Path) -> None:
    text = table("Time (s),Tensile strain (-),Stress (kPa)", PULLED.time_s, PULLED.strain, PULLED.stress)
    record = read(tmp_path, text + totals)
    assert len(record.strain) == len(PULLED.strain)
    assert any("no row of it" in sentence for sentence in record.left_out)


@pytest.mark.parametrize("dead", [0.0, 1e-3])
def test_a_channel_that_stands_still_is_not_taken(dead: float, tmp_path: Path) -> None:
    still = dead * np.sin(PULLED.time_s)
    text = table("Tensile extension (mm),Force X (N),Force Z (N)", PULLED.travel_mm, still, PULLED.load_N)
    record = read(tmp_path, text, Stated(gauge_length=0.02, area=2e-5))
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)
    assert any("(not 'Force X (N)')" in sentence for sentence in record.found)


@pytest.mark.parametrize("results", ["1,0.36,12\n2,0.37,13\n", "1,0.36,12\n"])
def test_a_table_of_results_is_no_specimen(results: str, tmp_path: Path) -> None:
    text = table("Tensile strain (-),Stress (kPa)", PULLED.strain, PULLED.stress)
    record = read(tmp_path, f"Results\n,Load (N),Extension (mm)\n{results}\n\n{text}")
    assert modulus(record) == pytest.approx(YOUNGS_MODULUS, rel=1e-3)
    assert not any("specimen" in sentence for sentence in record.found)


def test_formulas_without_values_are_named(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Extension (mm)", "Load (N)", "Strain (-)", "Stress (kPa)"])
    for row, (travel, load) in enumerate(zip(PULLED.travel_mm, PULLED.load_N, strict=True), start=2):
        sheet.append([float(travel), float(load), f"=A{row}/20", f"=B{row}/0.02"])
    book.save(tmp_path / "test.xlsx")
    with pytest.raises(
        InputError, match=r"row 1: 'Strain \(-\)' holds nothing; if it has formulas, save the file"
    ):
        read_record(tmp_path / "test.xlsx")


def test_a_file_of_old_office_programs_is_named(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"is an \.xls file or another of old office programs; save it as \.xlsx"
    ):
        read(tmp_path, bytes.fromhex("d0cf11e0a1b11ae1") + bytes(4096), name="test.xls")
