"""Files and folders that are there whole or not at all."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from estimator.errors import InputError


@contextmanager
def appearing(target: Path) -> Iterator[Path]:
    """Yield a path beside ``target`` to write a file or a folder to; it becomes ``target`` if all goes well.

    Raises
    ------
    InputError
        The target exists already.
    """
    if target.exists():
        raise InputError(f"{target}: exists already; name a new file or folder")
    target.parent.mkdir(parents=True, exist_ok=True)
    draft = target.with_name(f".{target.name}.partial")
    _remove(draft)
    try:
        yield draft
        draft.replace(target)
    finally:
        _remove(draft)


def replace_text(target: Path, text: str) -> None:
    """Write a text file in one step: a reader sees what was there before, or the new text."""
    draft = target.with_name(f"{target.name}.new")
    draft.write_text(text, encoding="utf-8")
    draft.replace(target)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
