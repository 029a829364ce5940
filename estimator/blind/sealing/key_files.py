"""Where the keys of a set lie: ``CASE/truth.toml`` or ``CASE.toml`` in a folder of their own."""

from pathlib import Path

from estimator.errors import InputError

KEY_FILE = "truth.toml"


def key_files(folder: Path) -> dict[str, Path]:
    """Return the files of all keys in a folder by the name of their case.

    Raises
    ------
    InputError
        There is none.
    """
    files = {file.parent.name: file for file in sorted(folder.glob(f"*/{KEY_FILE}"))}
    files |= {file.stem: file for file in sorted(folder.glob("*.toml"))}
    if not files:
        raise InputError(f"{folder}: holds no key; give a folder with CASE/{KEY_FILE} or CASE.toml")
    return files
