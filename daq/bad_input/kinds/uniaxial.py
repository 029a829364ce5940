"""Records of testing machines that a user hands over, with their reader and verb."""

from collections.abc import Callable
from pathlib import Path

from daq.bad_input.damage.any_file import TEXT
from daq.bad_input.damage.layout import NUMBERS
from daq.bad_input.damage.rewriting import REWRITTEN
from daq.bad_input.damage.sheet import SHEETS
from daq.bad_input.damage.value import TABLE
from daq.bad_input.kind import Kind
from daq.bad_input.samples import uniaxial as records
from daq.bad_input.samples.machine_exports import TEXT_LAYOUTS, YOUNGS_MODULUS
from estimator import uniaxial
from estimator.materials import law_named

_RIGHT = 0.02  # of the modulus


def _fit_uniaxial(folder: Path, name: str = "record.csv") -> uniaxial.UniaxialFit:
    fit = uniaxial.fit_record(uniaxial.read_record(folder / name), [law_named("neo_hookean")])
    uniaxial.as_text(fit)
    return fit


def _fit_gel(folder: Path) -> object:
    """Fit a rewritten export, which is refused or gives the right modulus."""
    modulus = _fit_uniaxial(folder).best.fit.youngs_modulus.value
    if abs(modulus / YOUNGS_MODULUS - 1) > _RIGHT:
        raise AssertionError(f"E = {modulus:.0f} Pa, and {YOUNGS_MODULUS:.0f} Pa is right")
    return modulus


def _uniaxial(name: str) -> Callable[[Path, Path], list[str]]:
    return lambda given, out: [
        "uniaxial", str(given / name), "--law", "neo_hookean", "--output", str(out / "report")
    ]  # fmt: skip


def _export_of_machine(layout: str) -> Kind:
    return Kind(
        f"export, {layout}",
        lambda folder: records.machine_export(folder, layout),
        {"record.csv": (*TEXT, *TABLE, *NUMBERS)},
        read=_fit_uniaxial,
        command=_uniaxial("record.csv"),
        quick=True,
    )


KINDS: tuple[Kind, ...] = (
    Kind(
        "tensile record",
        records.uniaxial,
        {"record.csv": (*TEXT, *TABLE)},
        read=_fit_uniaxial,
        command=_uniaxial("record.csv"),
        quick=True,
    ),
    *(_export_of_machine(layout) for layout in TEXT_LAYOUTS),
    Kind(
        "export, rewritten",
        lambda folder: records.machine_export(folder, "testXpert"),
        {"record.csv": REWRITTEN},
        read=_fit_gel,
        command=_uniaxial("record.csv"),
        quick=True,
    ),
    Kind(
        "export, spreadsheet",
        records.machine_workbook,
        {"record.xlsx": SHEETS},
        read=lambda folder: _fit_uniaxial(folder, "record.xlsx"),
        command=_uniaxial("record.xlsx"),
        quick=True,
    ),
)  # fmt: skip
