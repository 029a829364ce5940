"""Reads every case of a set once, and keeps the readings in a file: ``python -m challenge_baselines.readings_file``."""

import argparse
import json
import sys
import time
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from challenge_baselines.case_folder import case_folders
from challenge_baselines.reading import Reading, read

NONE, UNKNOWN = "none", "unknown"


@dataclass(frozen=True)
class Timed:
    """A reading, and the processor time that it took, s."""

    reading: Reading
    seconds: float


@dataclass(frozen=True)
class Opened:
    """A case whose key is known.

    Attributes
    ----------
    effects : labels; empty for none
    youngs_modulus, poisson_ratio : the truth, Pa and 1; of tissue that relaxes the long-term modulus
    """

    reading: Reading
    effects: tuple[str, ...]
    youngs_modulus: float
    poisson_ratio: float

    @property
    def label(self) -> str:
        """The one right answer: none, unknown, or the single cause; the first of several."""
        return self.effects[0] if self.effects else NONE


def read_readings(file: Path) -> dict[str, Timed]:
    """Return readings by the name of their case."""
    told = json.loads(file.read_text(encoding="utf-8"))
    return {name: Timed(_reading(one["reading"]), one["seconds"]) for name, one in told.items()}


def read_opened(readings: Path, keys: Path) -> list[Opened]:
    """Return the readings of a set whose keys are open."""
    found = []
    for name, timed in read_readings(readings).items():
        key = tomllib.loads((keys / f"{name}.toml").read_text(encoding="utf-8"))
        modulus = key["youngs_modulus"] * _left_in_the_end(key.get("parameters", {}))
        found.append(Opened(timed.reading, tuple(key["effects"]), modulus, key["poisson_ratio"]))
    return found


def _left_in_the_end(parameters: Mapping[str, object]) -> float:
    """Return which share of the stated modulus is the long-term one, as docs/challenge.md describes keys."""
    for name, value in parameters.items():
        if name.endswith("youngs_modulus_is") and value == "instantaneous":
            relaxed = parameters[name.removesuffix("youngs_modulus_is") + "relaxed_fraction"]
            return 1.0 - float(str(relaxed))
    return 1.0


def _reading(told: Mapping[str, object]) -> Reading:
    values = {name: tuple(value) if isinstance(value, list) else value for name, value in told.items()}
    return Reading(**values)  # type: ignore[arg-type] # fields by name, as they were written


def main(arguments: list[str]) -> int:
    """Read a set and write what was read."""
    parser = argparse.ArgumentParser(description="Read every case of a set once.")
    parser.add_argument("cases", type=Path, metavar="CASES", help="folder of the cases")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="readings, JSON")
    options = parser.parse_args(arguments)
    found = {}
    for folder in case_folders(options.cases):
        began = time.process_time()
        reading = read(folder)
        found[folder.name] = asdict(Timed(reading, round(time.process_time() - began, 3)))
    options.out.write_text(json.dumps(found), encoding="utf-8")
    print(f"{len(found)} cases read into {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
