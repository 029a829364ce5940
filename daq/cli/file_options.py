"""What options say of files of testing machines, without the readers: these take a second to import."""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from estimator.errors import InputError

# Sizes of a specimen as options call them, each with its metavar and dimension.
SIZES: Mapping[str, tuple[str, Literal["length", "area"]]] = {
    "gauge-length": ("LENGTH", "length"),
    "width": ("LENGTH", "length"),
    "thickness": ("LENGTH", "length"),
    "diameter": ("LENGTH", "length"),
    "area": ("AREA", "area"),
}


def add_what_a_file_may_leave_open(parser: argparse.ArgumentParser, modes: Sequence[str]) -> None:
    """Add the options that tell how the file of a testing machine is to be read."""
    group = parser.add_argument_group(
        "what the file of a test may leave open", "It is asked for where nothing tells it."
    )
    group.add_argument("--mode", choices=modes, help="of loading")
    for option, example in (("strain", "%%"), ("stress", "kPa"), ("force", "N"), ("length", "mm")):
        what = "travel" if option == "length" else option
        group.add_argument(
            f"--{option}-unit", metavar="UNIT", help=f"of a column of {what} without one, such as {example}"
        )
    for option, (metavar, _) in SIZES.items():
        group.add_argument(
            f"--{option}",
            metavar=metavar,
            help=f"of the specimen, with its unit, as in '20 {'mm2' if option == 'area' else 'mm'}'; outranks the file",
        )
    group.add_argument("--specimen", metavar="WHICH", help="number or label of one of several in a file")
    group.add_argument("--decimal", choices=("point", "comma"), help="mark of the numbers")
    group.add_argument(
        "--keep-zero",
        action="store_true",
        help="take the zeros of strain and stress as they are written, with slack and preload in them",
    )


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
