"""``retract diagnose FILE...``: the diagnosis of bench tests, whose inputs are files and not folders."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from daq.cli.verb import Result, progress
from estimator.errors import InputError
from estimator.uniaxial import Stated, stated_quantity
from estimator.uniaxial.diagnosis import as_json, as_text, diagnose_bench, write_report
from estimator.uniaxial.reading.whole import read_bench_test

_SIZES: Mapping[str, Literal["length", "area"]] = {
    "gauge_length": "length",
    "width": "length",
    "thickness": "length",
    "diameter": "length",
    "area": "area",
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for what the file of a bench test may leave open."""
    group = parser.add_argument_group("bench tests", "What a file of a bench test may leave open.")
    group.add_argument("--mode", choices=("tension", "compression", "shear"), help="of loading")
    for what in ("strain", "stress", "force", "length"):
        group.add_argument(f"--{what}-unit", metavar="UNIT", help=f"of a column of {what} without one")
    for size, dimension in _SIZES.items():
        option = "--" + size.replace("_", "-")
        group.add_argument(option, metavar=dimension.upper(), help="of the specimen, as in '20 mm'")


def are_bench_tests(paths: list[Path]) -> bool:
    """Tell whether inputs are files of bench tests.

    Raises
    ------
    InputError
        Some are files and some folders.
    """
    files = [path for path in paths if path.is_file()]
    if files and len(files) < len(paths):
        other = next(path for path in paths if not path.is_file())
        raise InputError(
            f"{other}: is no file, and {files[0]} is one; give files of bench tests, or one folder"
        )
    return bool(files)


def run_bench(options: argparse.Namespace) -> Result:
    """Diagnose bench tests, and tell the verdict."""
    shear = options.mode == "shear"
    stated = Stated(
        mode=None if shear else options.mode,
        strain_unit=options.strain_unit,
        stress_unit=options.stress_unit,
        force_unit=options.force_unit,
        length_unit=options.length_unit,
        gauge_length=_size(options, "gauge_length"),
        width=_size(options, "width"),
        thickness=_size(options, "thickness"),
        diameter=_size(options, "diameter"),
        area=_size(options, "area"),
    )
    tests = [read_bench_test(path, stated, shear=shear) for path in options.case]
    with progress() as tell:
        found = diagnose_bench(tests, tell)
    text, data = as_text(found), as_json(found)
    if options.output is not None:
        text += f"\nReport: {write_report(found, options.output)}"
    return Result(text, data)


def _size(options: argparse.Namespace, size: str) -> float | None:
    text = getattr(options, size)
    return None if text is None else stated_quantity(text, _SIZES[size], f"--{size.replace('_', '-')}")
