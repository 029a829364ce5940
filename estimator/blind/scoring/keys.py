"""The answers to sealed cases: checked against what was committed to, and each opening counted."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from estimator.blind.scoring.labels import FAMILIES, within_catalogue
from estimator.blind.sealing.commitment import KEYS_LIST, check_keys, read_commitment
from estimator.blind.sealing.key_files import key_files
from estimator.blind.sealing.openings import Openings, count_opening
from estimator.effects.blocks import GROUPS
from estimator.errors import InputError
from estimator.input_file import is_number, parse_toml, read_input_text

_MODULUS_IS = "youngs_modulus_is"
_MATERIAL = ("youngs_modulus", "poisson_ratio")


@dataclass(frozen=True, slots=True)
class Key:
    """The truth of one case.

    Attributes
    ----------
    effects : labels; empty for none, "unknown" for one outside the catalogue
    youngs_modulus : Pa; of tissue that relaxes the long-term one, which the diagnosis tells, whichever the key states
    poisson_ratio : of the tissue
    centre : of a local effect, m; None where there is none
    level : by how much the effect stands out: clear, moderate, subtle, …; empty where the key does not say
    sigma : by how many standard deviations of the noise, after E and ν are fitted, each effect stands out; empty where
        the key does not say
    family : how far the catalogue knows the forms of the effects, of several the one that it knows least; empty where
        there is no effect, and where the key does not say
    block : of the rig on which an effect outside the catalogue acts; empty for others, and where the key does not say
    """

    effects: tuple[str, ...]
    youngs_modulus: float
    poisson_ratio: float
    centre: tuple[float, float, float] | None
    level: str
    sigma: tuple[float, ...]
    family: str = ""
    block: str = ""


def open_keys(folder: Path, reader: str) -> tuple[dict[str, Key], Openings]:
    """Read all keys in a folder by the name of their case, count the opening, and return how many there have been.

    A key is ``CASE/truth.toml`` or ``CASE.toml``. Each opening is a line in ``openings.txt`` beside them. Where the set
    was committed to, the keys must be those.

    Parameters
    ----------
    reader : what the keys are opened for, one line

    Raises
    ------
    InputError
        There is no key, one cannot be read, or one is not what was committed to.
    """
    files = key_files(folder)
    if (folder / KEYS_LIST).exists():
        check_keys(folder, read_commitment(folder))
    openings = count_opening(folder, reader)
    return {name: _read_key(file) for name, file in files.items()}, openings


def _read_key(file: Path) -> Key:
    stated = parse_toml(read_input_text(file), file)
    generator, where = (_table(stated, name, file) for name in ("generator", "where"))
    effects = stated.get("effects")
    if not isinstance(effects, list) or not all(isinstance(label, str) for label in effects):
        raise InputError(f"{file}: effects is no list of labels; an empty list says that there is none")
    modulus, ratio = (_number(stated, name, file) for name in _MATERIAL)
    if modulus <= 0:
        raise InputError(f"{file}: youngs_modulus is {modulus:g} Pa; state a positive one")
    return Key(
        effects=within_catalogue(effects),
        youngs_modulus=modulus * _share_left(_table(stated, "parameters", file), file),
        poisson_ratio=ratio,
        centre=_point(where["centre"], file) if "centre" in where else None,
        level=" and ".join(_levels(generator.get("level", []), file)),
        sigma=_sigma(generator.get("sigma", []), file),
        family=_family(generator.get("in_family", []), file),
        block=_block(generator.get("block", ""), file),
    )


def _share_left(parameters: Mapping[str, Any], file: Path) -> float:
    """Return the share of the stated modulus that is left once the stress has relaxed: 1 where the long-term one is."""
    for name, stated in parameters.items():
        if name.endswith(_MODULUS_IS) and stated == "instantaneous":
            relaxed = _number(parameters, name.removesuffix(_MODULUS_IS) + "relaxed_fraction", file)
            if not 0 <= relaxed < 1:
                raise InputError(f"{file}: relaxed_fraction is {relaxed:g}; state a share from 0 to below 1")
            return 1.0 - relaxed
    return 1.0


def _table(stated: Mapping[str, Any], name: str, file: Path) -> Mapping[str, Any]:
    value = stated.get(name, {})
    if not isinstance(value, dict):
        raise InputError(f"{file}: {name} is no table; write [{name}], and what belongs to it below")
    return value


def _levels(value: object, file: Path) -> list[str]:
    """Return the levels of the effects, of which a single one may stand for itself."""
    levels: list[object] = value if isinstance(value, list) else [value]
    words = [level for level in levels if isinstance(level, str)]
    if words != levels:
        raise InputError(
            f"{file}: [generator] level is no word; state clear, moderate or the like, or leave it out"
        )
    return words


def _sigma(value: object, file: Path) -> tuple[float, ...]:
    """Return how far the effects stand out, of which a single one may stand for itself."""
    numbers: list[Any] = value if isinstance(value, list) else [value]
    if not all(is_number(number) and number >= 0 for number in numbers):
        raise InputError(
            f"{file}: [generator] sigma is {value}; state a number for each effect, or leave it out"
        )
    return tuple(map(float, numbers))


def _family(value: object, file: Path) -> str:
    """Return how far the catalogue knows the least known of the forms, of which a single one may stand for itself."""
    families: list[object] = value if isinstance(value, list) else [value]
    if not all(family in FAMILIES for family in families):
        raise InputError(
            f"{file}: [generator] in_family is {value}; state {', '.join(FAMILIES)} for each effect, or leave it out"
        )
    return max((str(family) for family in families), key=FAMILIES.index, default="")


def _block(value: object, file: Path) -> str:
    blocks = sorted({block.name for block in GROUPS.values()})
    if value and value not in blocks:
        raise InputError(
            f"{file}: [generator] block is {value}; state one of {', '.join(blocks)}, or leave it out"
        )
    return str(value)


def _number(table: Mapping[str, Any], name: str, file: Path) -> float:
    value = table.get(name)
    if not is_number(value):
        raise InputError(f"{file}: {name} is missing or no number; state it")
    return float(value)


def _point(value: object, file: Path) -> tuple[float, float, float]:
    if isinstance(value, list) and len(value) == 3 and all(map(is_number, value)):
        x, y, z = map(float, value)
        return x, y, z
    raise InputError(f"{file}: [where] centre is {value}; state three numbers in metres")
