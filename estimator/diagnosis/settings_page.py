"""The numbers of the diagnosis as a page: ``python -m estimator.diagnosis.settings_page > docs/method/settings.md``."""

import argparse
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from estimator.diagnosis.declared_numbers import KINDS, Number
from estimator.diagnosis.settings import DiagnosisSettings

_HEAD = """# The numbers of the diagnosis

`estimator/diagnosis/settings.py` holds every number that is not physics. A *definition* says what a word means, a
*grid* is that of a quadrature, a *budget* limits work, and a *calibrated* number was chosen by what cases with known
answers showed. A script may set any of them: `diagnose(..., settings=DiagnosisSettings(...))`. This page is made by
`python -m estimator.diagnosis.settings_page`; a test holds that it is up to date.
"""
_COLUMNS = """
| number | value | unit | reason |
| --- | --- | --- | --- |
"""
_ORIGINS = """
## Where the calibrated ones come from

"Opened until" is the last seed of `retract benchmark make` whose keys had been opened when the number came: no later
one can have served. Half and twice say what moving the number did, where anybody has looked.

| number | commit | opened until | what cases showed | half | twice |
| --- | --- | --- | --- | --- | --- |
"""


def origins() -> dict[str, dict[str, Any]]:
    """Return the origin of each calibrated number by its name, as ``calibration.toml`` has it."""
    read = tomllib.loads(Path(__file__).with_name("calibration.toml").read_text(encoding="utf-8"))
    return {name: row for name, row in read.items() if isinstance(row, dict)}


def page() -> str:
    """Return the page in Markdown."""
    return "".join([_HEAD, *_tables(), _ORIGINS, *(_origin(name, row) for name, row in origins().items())])


def _tables() -> Iterator[str]:
    numbers = list(DiagnosisSettings().numbers())
    for kind in KINDS:
        chosen = [number for number in numbers if number.kind == kind]
        yield f"\n## {kind.capitalize()} ({len(chosen)})\n{_COLUMNS}"
        yield from map(_row, chosen)


def _row(number: Number) -> str:
    values = number.value if isinstance(number.value, tuple) else (number.value,)
    value = ", ".join(f"{value:.4g}" for value in values)
    return f"| `{number.name}` | {value} | {number.unit} | {number.reason} |\n"


def _origin(name: str, row: dict[str, Any]) -> str:
    since = f"{row['opened_until'] or 'none'}" + ("; since the scores" if row.get("since_scored") else "")
    return f"| `{name}` | {row['commit']} | {since} | {row['statistic']} | {row['half']} | {row['twice']} |\n"


def main() -> None:
    """Print the page."""
    argparse.ArgumentParser(
        description="Print the numbers of the diagnosis as a page in Markdown."
    ).parse_args()
    sys.stdout.write(page())


if __name__ == "__main__":
    main()
