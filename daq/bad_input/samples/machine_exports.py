"""Tests of one gel as the programs of testing machines export them: their layouts, languages, units and encodings.

Every layout tells the same curve, so that whoever reads it has to come to the same modulus.
"""

import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, TypeAlias

import numpy as np
import openpyxl
from numpy.typing import NDArray

YOUNGS_MODULUS = 30e3
"""Of the gel, Pa."""

FloatArray: TypeAlias = NDArray[np.float64]
Mode: TypeAlias = Literal["tension", "compression"]


@dataclass(frozen=True, slots=True, eq=False)
class GelTest:
    """A test of a bar 20 mm long of 10 by 2 mm, or of a cylinder 20 mm high and 25 mm across.

    Attributes
    ----------
    mode : of loading
    strain : (n,) as the machine writes it
    stress : (n,) as the machine writes it, kPa
    """

    mode: Mode
    strain: FloatArray
    stress: FloatArray

    @property
    def time_s(self) -> FloatArray:
        """Time of each row."""
        return np.arange(len(self.strain), dtype=np.float64) / 2.0

    @property
    def travel_mm(self) -> FloatArray:
        """Travel as the machine writes it."""
        return 20.0 * self.strain

    @property
    def load_N(self) -> FloatArray:
        """Load as the machine writes it."""
        area_mm2 = 20.0 if self.mode == "tension" else float(np.pi / 4 * 25.0**2)
        return self.stress * area_mm2 / 1e3

    @property
    def sizes_mm(self) -> Mapping[str, float]:
        """Sizes that a report states."""
        shape = {"Width": 10.0, "Thickness": 2.0} if self.mode == "tension" else {"Diameter": 25.0}
        return {"Length": 20.0, **shape}


def neo_hookean_kPa(strain: FloatArray, mode: Mode) -> FloatArray:
    """Return the magnitude of nominal stress of the gel at magnitudes of strain."""
    stretch = 1 + strain if mode == "tension" else 1 - strain
    return np.asarray(YOUNGS_MODULUS / 3e3 * np.abs(stretch - stretch**-2))


def gel_test(
    mode: Mode = "tension", *, compression_sign: float = 1.0, noise: float = 0.0, rows: int = 81
) -> GelTest:
    """Return a test to 80 % in tension, 40 % in compression.

    Parameters
    ----------
    compression_sign : that the machine gives to compression; it writes tension positive
    noise : standard deviation, as a share of the largest stress
    """
    strain = np.linspace(0.0, 0.8 if mode == "tension" else 0.4, rows)
    stress = neo_hookean_kPa(strain, mode)
    stress = stress + noise * stress.max() * np.random.default_rng(7).standard_normal(rows)
    sign = 1.0 if mode == "tension" else compression_sign
    return GelTest(mode, sign * strain, sign * stress)


def bluehill(test: GelTest, *, decimal: str = ".", separator: str = ",") -> str:
    """Return an export of Instron Bluehill: facts, names, a row of units, quoted numbers."""
    kind = "Tensile" if test.mode == "tension" else "Compressive"
    travel = "Extension" if test.mode == "tension" else "Compressive extension"
    facts = [["Specimen label", '"gel 3"']]
    facts += [[name, _quoted(f"{size:.5f}", decimal), "mm"] for name, size in test.sizes_mm.items()]
    names = ["Time", travel, "Load", f"{kind} strain ({travel})", f"{kind} stress"]
    units = ["(s)", "(mm)", "(N)", "(mm/mm)", "(MPa)"]
    columns = [test.time_s, test.travel_mm, test.load_N, test.strain, test.stress / 1e3]
    rows = [[_quoted(f"{value:.8f}", decimal) for value in row] for row in zip(*columns, strict=True)]
    return _lines([*facts, [], names, units, *rows], separator)


def bluehill_load(test: GelTest) -> str:
    """Return an export of Instron Bluehill without stress and strain."""
    length = "Anvil height" if test.mode == "compression" else "Strain 1 gauge length"
    facts = [
        [length if name == "Length" else name, f'"{size:.5f}"', "mm"] for name, size in test.sizes_mm.items()
    ]
    facts = [["Method", "Compression of gels" if test.mode == "compression" else "Tensile test"], *facts]
    rows = [
        [f'"{value:.6f}"' for value in row]
        for row in zip(test.time_s, test.travel_mm, test.load_N, strict=True)
    ]
    return _lines([*facts, [], ["Time", "Extension", "Load"], ["(s)", "(mm)", "(N)"], *rows], ",")


def zwick_testxpert(test: GelTest, *, separator: str = "\t") -> str:
    """Return an export of ZwickRoell testXpert in German: decimal commas, units in a row of their own."""
    kind = "Zugversuch" if test.mode == "tension" else "Druckversuch"
    strain = "Dehnung" if test.mode == "tension" else "Stauchung"
    sizes = {
        "Length": "Messlänge L0",
        "Width": "Probenbreite b0",
        "Thickness": "Probendicke a0",
        "Diameter": "Durchmesser d0",
    }
    facts = [["Prüfart", kind], ["Prüfer", "Meier"]]
    facts += [[sizes[name], f"{size:.2f}".replace(".", ","), "mm"] for name, size in test.sizes_mm.items()]
    names, units = ["Prüfzeit", strain, "Standardkraft"], ["s", "%", "N"]
    columns = [test.time_s, 100 * test.strain, test.load_N]
    rows = [[f"{value:.6f}".replace(".", ",") for value in row] for row in zip(*columns, strict=True)]
    return _lines([*facts, [], names, units, *rows], separator)


def trapezium(test: GelTest) -> str:
    """Return an export of Shimadzu Trapezium: all quoted, sizes stand below their names."""
    kind = "Tensile" if test.mode == "tension" else "Compression"
    names = {"Length": "Gauge_Length", "Width": "Width", "Thickness": "Thickness", "Diameter": "Diameter"}
    table = [
        ["Key Word", "", "Product Name", "", "Test File Name", "gel.xtas"],
        ["Name", "Test Type", "Speed"],
        ["Parameters", kind, "5mm/min"],
        ["Name", *(names[name] for name in test.sizes_mm)],
        ["Unit", *("mm" for _ in test.sizes_mm)],
        ["1 _ 1", *(f"{size:.4f}" for size in test.sizes_mm.values())],
        [],
        ["1 _ 1"],
        ["Time", "Force", "Stroke"],
        ["sec", "N", "mm"],
        *(
            [f"{value:.6f}" for value in row]
            for row in zip(test.time_s, test.load_N, test.travel_mm, strict=True)
        ),
    ]
    return _lines([[f'"{cell}"' for cell in row] for row in table], ",")


def mts(test: GelTest) -> str:
    """Return an export of MTS TestSuite: tabs, names and units in brackets below them."""
    kind = "Compression" if test.mode == "compression" else "Tension"
    sizes = {"Length": "Gage Length", "Width": "Width", "Thickness": "Thickness", "Diameter": "Diameter"}
    facts = [
        ["Test Name", f"{kind} test 4"],
        *([sizes[n], f"{size:g}", "mm"] for n, size in test.sizes_mm.items()),
    ]
    rows = [
        [f"{value:.6f}" for value in row]
        for row in zip(test.travel_mm, test.load_N, test.time_s, strict=True)
    ]
    return _lines([*facts, [], ["Crosshead ", "Load ", "Time "], ["(mm)", "(N)", "(s)"], *rows], "\t")


def plain(test: GelTest) -> str:
    """Return a table of two columns, as people write it."""
    kind = "strain" if test.mode == "tension" else "compressive strain"
    rows = [[f"{e:.6f}", f"{s:.6f}"] for e, s in zip(test.strain, test.stress, strict=True)]
    return _lines([[f"{kind} (-)", "stress (kPa)"], *rows], ",")


TEXT_LAYOUTS: Mapping[str, Callable[[GelTest], str]] = MappingProxyType(
    {
        "Bluehill": bluehill,
        "Bluehill, load": bluehill_load,
        "testXpert": zwick_testxpert,
        "Trapezium": trapezium,
        "TestSuite": mts,
        "plain": plain,
    }
)


def workbook(test: GelTest, *, as_text: bool = False, specimens: int = 1) -> bytes:
    """Return a spreadsheet as those programs write it: results first, then a sheet for each specimen.

    Parameters
    ----------
    as_text : store numbers as text with decimal commas
    specimens : how many, the first as given and each further one twice as stiff as the one before
    """
    book = openpyxl.Workbook()
    results = book.active
    results.title = "Results"
    for name, size in test.sizes_mm.items():
        results.append([name, size, "mm"])
    words = ("Tensile", "Extension") if test.mode == "tension" else ("Compressive", "Compressive extension")
    for number in range(specimens):
        sheet = book.create_sheet(f"Specimen {number + 1}")
        sheet.append(["Time", words[1], "Load", f"{words[0]} strain", f"{words[0]} stress"])
        sheet.append(["s", "mm", "N", "%", "kPa"])
        factor = 2.0**number
        columns = [
            test.time_s,
            test.travel_mm,
            factor * test.load_N,
            100 * test.strain,
            factor * test.stress,
        ]
        for row in zip(*columns, strict=True):
            sheet.append([f"{value:.6f}".replace(".", ",") if as_text else float(value) for value in row])
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


def _quoted(number: str, decimal: str) -> str:
    return f'"{number.replace(".", decimal)}"'


def _lines(rows: Sequence[Sequence[str]], separator: str) -> str:
    return "\n".join([*(separator.join(row) for row in rows), ""])
