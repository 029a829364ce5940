"""Records of testing machines."""

from pathlib import Path

import numpy as np

from daq.bad_input.samples.machine_exports import TEXT_LAYOUTS, gel_test, workbook


def uniaxial(folder: Path) -> None:
    """Write the record of a tensile test."""
    stretch = np.linspace(1.0, 1.6, 25)
    stress_kPa = 10.0 * (stretch - stretch**-2)
    rows = [f"{strain:.6f},{stress:.6f}" for strain, stress in zip(stretch - 1, stress_kPa, strict=True)]
    facts = ["Specimen,A1", "Strain,crosshead travel", "Initial height (mm),20.0"]
    (folder / "record.csv").write_text(
        "\n".join([*facts, "Engineering strain (-),Engineering stress (kPa)", *rows, ""]), encoding="utf-8"
    )


def machine_export(folder: Path, layout: str) -> None:
    """Write the record of a compression test as a testing machine's program does."""
    text = TEXT_LAYOUTS[layout](gel_test("compression", noise=1e-3, rows=41))
    (folder / "record.csv").write_text(text, encoding="utf-8")


def machine_workbook(folder: Path) -> None:
    """Write a spreadsheet with the tests of two specimens."""
    (folder / "record.xlsx").write_bytes(workbook(gel_test(noise=1e-3, rows=41), specimens=2))
