"""A seed that nobody can guess: who knows the seed of a set can make its keys again."""

import secrets
from pathlib import Path

from estimator.errors import InputError
from estimator.input_file import read_input_text

SEED_FILE = "seed.txt"

# A key is TOML, whose integers have 64 bits with their sign.
_BITS = 63


def secret_seed(keys: Path) -> int:
    """Return the seed that lies among the keys of a set, drawn at the first call.

    Raises
    ------
    InputError
        What lies there is no seed.
    """
    file = keys / SEED_FILE
    if not file.exists():
        keys.mkdir(parents=True, exist_ok=True)
        file.write_text(f"{secrets.randbits(_BITS)}\n", encoding="utf-8")
    text = read_input_text(file).strip()
    if not (text.isascii() and text.isdecimal() and len(text) < 20):
        raise InputError(f"{file}: holds no seed; restore it, or begin in another folder")
    return int(text)
