"""A published table of (E, ν) by condition, and the bench test of the same materials: the paper's, or anyone's file.

A TOML file::

    [bench."1:1:0"]
    youngs_modulus_pa = 36210
    std_pa = 2620

    [[estimate]]
    material = "1:1:0"
    anchoring = "one_side"            # or "two_sides"
    motion = "pull"                   # or "gradual_tangent_pull", "twist_and_pull"
    youngs_modulus_pa = 26450
    poisson_ratio = 0.304

and, where they differ from the paper's, ``[set_up]`` with ``way_m``, ``tangent_rad``, ``twist_rad``, ``density``. A CSV
file has the columns of ``[[estimate]]``, and ``bench_pa`` and ``bench_std_pa`` in every row.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.errors import InputError
from estimator.input_file import is_number, parse_number, parse_toml, read_input_text
from estimator.studies.paper_tables.figures import BENCH, TABLE_VI, TABLE_VII
from estimator.studies.published_gap.retractions import ANCHORINGS, MOTION_NAMES, SetUp
from estimator.studies.published_gap.simulations import CONDITIONS

FloatArray = NDArray[np.float64]

_TEXTS = ("material", "anchoring", "motion")
_NUMBERS = ("youngs_modulus_pa", "poisson_ratio")
_BENCH_COLUMNS = ("bench_pa", "bench_std_pa")
_SET_UP = ("way_m", "tangent_rad", "twist_rad", "density")


@dataclass(frozen=True, slots=True)
class Bench:
    """E of a material by a bench test, mean and standard deviation, Pa."""

    youngs_modulus_pa: float
    std_pa: float


@dataclass(frozen=True, slots=True)
class PublishedEstimate:
    """One estimate as it was published."""

    material: str
    anchoring: str
    motion: str
    youngs_modulus_pa: float
    poisson_ratio: float


@dataclass(frozen=True)
class PublishedTable:
    """Estimates by condition, and the bench test of their materials.

    Attributes
    ----------
    name : for titles
    bench : by material
    estimates : in the table's order
    set_up : what the retractions had in common
    """

    name: str
    bench: Mapping[str, Bench]
    estimates: tuple[PublishedEstimate, ...]
    set_up: SetUp = field(default_factory=SetUp)

    @property
    def materials(self) -> tuple[str, ...]:
        """The materials, in the order of the bench test."""
        return tuple(self.bench)

    @property
    def material_of(self) -> NDArray[np.int64]:
        """Number of each estimate's material, (n,)."""
        return np.array([self.materials.index(one.material) for one in self.estimates])

    @property
    def condition_of(self) -> NDArray[np.int64]:
        """Number of each estimate's condition in :data:`~.learning.CONDITIONS`, (n,)."""
        names = [tuple(map(str, condition)) for condition in CONDITIONS]
        return np.array([names.index((one.anchoring, one.motion)) for one in self.estimates])

    @property
    def log_modulus(self) -> FloatArray:
        """Logarithm of the published E, (n,)."""
        return np.log([one.youngs_modulus_pa for one in self.estimates])

    @property
    def poisson_ratio(self) -> FloatArray:
        """The published ν, (n,)."""
        return np.array([one.poisson_ratio for one in self.estimates])


def paper_table() -> PublishedTable:
    """Return the paper's Tables VI and VII."""
    rows = tuple(
        PublishedEstimate(material, anchoring, motion, figure.youngs_modulus_pa, figure.poisson_ratio)
        for anchoring, table in (("one_side", TABLE_VI), ("two_sides", TABLE_VII))
        for (motion, material), figure in table.items()
    )
    bench = {material: Bench(*pair) for material, pair in BENCH.items()}
    return PublishedTable("the paper's Tables VI and VII", bench, rows)


def read_table(file: Path) -> PublishedTable:
    """Read a published table from a TOML or a CSV file.

    Raises
    ------
    InputError
        The file is neither, or lacks something, or says something impossible; the message says what and where.
    """
    text = read_input_text(file)
    if file.suffix.lower() == ".toml":
        table = _from_toml(parse_toml(text, file), file)
    elif file.suffix.lower() == ".csv":
        table = _from_csv(text, file)
    else:
        raise InputError(f"{file}: is neither .toml nor .csv; name a table in one of these")
    _check(table, file)
    return table


def _from_toml(data: dict[str, Any], file: Path) -> PublishedTable:
    if odd := set(data) - {"bench", "estimate", "set_up"}:
        raise InputError(f"{file}: [{sorted(odd)[0]}] is not known; it has bench, estimate and set_up")
    bench_part, estimates, set_up = data.get("bench", {}), data.get("estimate", []), data.get("set_up", {})
    if not isinstance(bench_part, dict) or not isinstance(estimates, list) or not isinstance(set_up, dict):
        raise InputError(f"{file}: write [bench.MATERIAL], [[estimate]] and [set_up]")
    bench = {}
    for material, entry in bench_part.items():
        where = f"{file}: [bench.{material}]"
        bench[material] = Bench(_number(entry, "youngs_modulus_pa", where), _number(entry, "std_pa", where))
    rows = tuple(_estimate(entry, f"{file}: estimate {n}") for n, entry in enumerate(estimates, start=1))
    if odd := set(set_up) - set(_SET_UP):
        raise InputError(f"{file}: set_up has no '{sorted(odd)[0]}'; it has {', '.join(_SET_UP)}")
    given = {name: _number(set_up, name, f"{file}: [set_up]") for name in set_up}
    usual = SetUp()
    stated = replace(
        usual,
        way_m=given.get("way_m", usual.way_m),
        tangent_rad=given.get("tangent_rad", usual.tangent_rad),
        twist_rad=given.get("twist_rad", usual.twist_rad),
        density=given.get("density", usual.density),
    )
    return PublishedTable(file.name, bench, rows, stated)


def _from_csv(text: str, file: Path) -> PublishedTable:
    reader = csv.DictReader(io.StringIO(text))
    needed = (*_TEXTS, *_NUMBERS, *_BENCH_COLUMNS)
    if missing := [name for name in needed if name not in (reader.fieldnames or ())]:
        raise InputError(f"{file}: has no column '{missing[0]}'; it needs {', '.join(needed)}")
    rows, bench = [], dict[str, Bench]()
    for line in reader:
        where = f"{file}, line {reader.line_num}"
        entry: dict[str, object] = dict(line)
        for name in (*_NUMBERS, *_BENCH_COLUMNS):
            try:
                entry[name] = parse_number((line[name] or "").strip())
            except ValueError:
                raise InputError(f"{where}: {name} = '{line[name]}' is no number; correct it") from None
        rows.append(_estimate(entry, where))
        found = Bench(*(_number(entry, name, where) for name in _BENCH_COLUMNS))
        if bench.setdefault(rows[-1].material, found) != found:
            raise InputError(f"{where}: another bench test of {rows[-1].material} than above; give one")
    return PublishedTable(file.name, bench, tuple(rows))


def _estimate(entry: object, where: str) -> PublishedEstimate:
    texts = []
    for name in _TEXTS:
        value = entry.get(name) if isinstance(entry, dict) else None
        if not isinstance(value, str) or not value.strip():
            raise InputError(f"{where}: has no {name}; give it")
        texts.append(value.strip())
    modulus, ratio = (_number(entry, name, where) for name in _NUMBERS)
    return PublishedEstimate(texts[0], texts[1], texts[2], modulus, ratio)


def _number(entry: object, name: str, where: str) -> float:
    value = entry.get(name) if isinstance(entry, dict) else None
    if not is_number(value):
        raise InputError(f"{where}: has no number {name}; give it in SI units")
    return float(value)


def _check(table: PublishedTable, file: Path) -> None:
    if not table.estimates:
        raise InputError(f"{file}: has no estimate; give at least one row")
    seen = set()
    for number, one in enumerate(table.estimates, start=1):
        where = f"{file}: estimate {number}"
        _one_of(one.anchoring, ANCHORINGS, where, "anchoring")
        _one_of(one.motion, MOTION_NAMES, where, "motion")
        _one_of(one.material, table.materials, where, "material")
        if not one.youngs_modulus_pa > 0:
            raise InputError(f"{where}: E = {one.youngs_modulus_pa:g} Pa is not above zero; correct it")
        if not -1 < one.poisson_ratio < 0.5:
            raise InputError(f"{where}: ν = {one.poisson_ratio:g} is not between −1 and 0.5; correct it")
        seen.add((one.material, one.anchoring, one.motion))
    for material, bench in table.bench.items():
        if not (bench.youngs_modulus_pa > 0 and bench.std_pa > 0):
            raise InputError(
                f"{file}: bench test of {material}: E and its deviation must be above zero; correct them"
            )
    set_up = table.set_up
    if not (0 < set_up.way_m <= 0.03 and set_up.density > 0):
        raise InputError(f"{file}: set_up: way_m must lie in 0 to 0.03 and density above 0; correct it")
    if not (abs(set_up.tangent_rad) <= 1.2 and abs(set_up.twist_rad) <= 1.2):
        raise InputError(f"{file}: set_up: angles are in rad, at most 1.2; correct them")


def _one_of(value: str, known: Sequence[str], where: str, name: str) -> None:
    if value not in known:
        raise InputError(f"{where}: {name} '{value}' is none of {', '.join(known) or 'those given'}")
