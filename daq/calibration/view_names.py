"""Which stored images belong together, and which camera took each: read off their names.

The camera is told by words or letters in the name or in the folder (left and right, L and R, cam0 and cam1, folders
image_0 and image_1, what the caller says), the moment by a time stamp in the name, or else by all that remains of it.
Two images are never a pair for their places in a list: where one is lost, all after it would be of different moments.
"""

import re
import unicodedata
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np

from daq.calibration.name_times import time_in_name_ns
from daq.errors import CalibrationError
from daq.timing.pairing import pair_by_time

TOLERANCE_S = 0.02

Sides = tuple[list[str], list[str]]
Key = tuple[tuple[int, int, str], ...]

_TOKEN = re.compile(r"\d+|[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|[左右]|[^\W\d_A-Za-z左右]+")
_LEFT = (
    "left", "lft", "lhs", "links", "linke", "gauche", "izquierda", "izq", "sinistra", "sx", "esquerda", "vanster",
    "venstre", "lewa", "lewy", "leva", "levy", "левая", "левыи", "лев", "左", "왼쪽",
)  # fmt: skip
_RIGHT = (
    "right", "rgt", "rhs", "rechts", "rechte", "droite", "derecha", "der", "destra", "dx", "direita", "hoger", "hoyre",
    "hojre", "prawa", "prawy", "prava", "pravy", "правая", "правыи", "прав", "右", "오른쪽",
)  # fmt: skip
_WORDS = ({**dict.fromkeys(_LEFT, 0), **dict.fromkeys(_RIGHT, 1)}, {"l": 0, "r": 1})
_STROKED = str.maketrans("øØłŁ", "oOlL")  # letters that are not taken apart
# What cameras are counted by, the left one first.
_COUNTED = (("0", "1"), ("1", "2"), ("a", "b"))
_FEWEST_PAIRS = 3
_NUMBERED = re.compile(r"(?<![a-z])(cam|camera|c)[ _-]?(\d+)(?!\d)", re.IGNORECASE)
_NUMBERED_FOLDER = re.compile(r"\b(images?|img|cam[a-z]*)[ _-]?(\d+)(?=/)", re.IGNORECASE)
_LEAST_SERIAL_DIGITS = 5


@dataclass(frozen=True, slots=True)
class PairedNames:
    """Names of images, paired.

    Attributes
    ----------
    pairs : left and right name of each pair, in the order of their numbers or times
    alone : names without a partner, and those that tell no camera
    told_by : how the names tell, for a person
    first_paired : whether the first moment of all has both images
    """

    pairs: tuple[tuple[str, str], ...]
    alone: tuple[str, ...]
    told_by: str
    first_paired: bool


def pair_names(
    names: Sequence[str], marks: tuple[str, str] | None = None, tolerance_s: float = TOLERANCE_S
) -> PairedNames:
    """Pair the images of two cameras by their names, paths below one folder with ``/``.

    Parameters
    ----------
    marks : what the names of the left and of the right camera's images hold, such as serial numbers
    tolerance_s : largest difference of the time stamps of a pair

    Raises
    ------
    CalibrationError
        The names do not tell the camera or the moment, or two images of one camera have the same moment.
    """
    found = _sides(names, marks)
    if found is None:
        raise CalibrationError(_no_sides(names, marks))
    sides, rests, told_by = found
    times = [{name: time_in_name_ns(rests[name]) for name in side} for side in sides]
    if _all_told(times):
        moments = [{name: time for name, time in side.items() if time is not None} for side in times]
        pairs = _by_time(moments, tolerance_s)
        told_by += f"; paired by the time in the name, within {tolerance_s * 1e3:g} ms"
        first = min((time, name) for side in moments for name, time in side.items())[1]
    else:
        keys = _keys(sides, rests)
        pairs = _by_key(sides, keys)
        told_by += "; paired by the number in the name"
        first = min((keys[name], name) for side in sides for name in side)[1]
    paired = {name for pair in pairs for name in pair}
    alone = tuple(sorted(set(names) - paired))
    return PairedNames(pairs, alone, told_by, first in paired)


def _sides(
    names: Sequence[str], marks: tuple[str, str] | None
) -> tuple[Sides, Mapping[str, str], str] | None:
    """Return the left and the right names, what remains of each without its mark, and how they tell."""
    for told_by, look in _schemes(names, marks):
        seen = {name: look(name) for name in names}
        sides: Sides = ([], [])
        for name, (side, _) in seen.items():
            if side is not None:
                sides[side].append(name)
        if all(sides):
            return sides, {name: rest for name, (_, rest) in seen.items()}, told_by
    return None


class _Look:
    """Tells the side of a name, None where it tells none or both, and what remains of it."""

    def __init__(self, pattern: re.Pattern[str], sides: Mapping[str, int]) -> None:
        self._pattern, self._sides = pattern, sides

    def __call__(self, name: str) -> tuple[int | None, str]:
        stem = _stem(name)
        marks = [m for m in self._pattern.finditer(stem) if m.group(0).lower() in self._sides]
        # a folder of both cameras may be called after both
        in_file = [mark for mark in marks if mark.start() > stem.rfind("/")]
        told = {self._sides[mark.group(0).lower()] for mark in in_file or marks}
        rest = stem
        for mark in reversed(marks):
            rest = f"{rest[: mark.start()]} {rest[mark.end() :]}"
        return (told.pop() if len(told) == 1 else None), rest


class _ColumnLook:
    """Tells the side by the word or number at one place of all names, and what remains of them."""

    def __init__(self, column: int, counted: tuple[str, str]) -> None:
        self._column, self._counted = column, counted

    def __call__(self, name: str) -> tuple[int | None, str]:
        stem = _stem(name)
        mark = list(_TOKEN.finditer(stem))[self._column]
        return self._counted.index(_plain(mark.group(0))), f"{stem[: mark.start()]} {stem[mark.end() :]}"


def _stem(name: str) -> str:
    """Return a name without its suffix and without accents."""
    return _without_accents(str(PurePosixPath(name).with_suffix("")))


def _without_accents(text: str) -> str:
    bare = "".join(one for one in unicodedata.normalize("NFKD", text) if not unicodedata.combining(one))
    return unicodedata.normalize("NFC", bare).translate(_STROKED)


def _plain(token: str) -> str:
    """Return a word without case, a number without zeros before it."""
    return str(int(token)) if token.isdigit() else token.lower()


def _columns(names: Sequence[str]) -> Iterator[tuple[str, _ColumnLook]]:
    """Yield how to tell two cameras that are counted: by a place at which, apart from it, the names go in pairs."""
    tokens = [_TOKEN.findall(_stem(name)) for name in names]
    if len(set(map(len, tokens))) != 1:
        return
    for column in range(len(tokens[0])):
        counted = tuple(sorted({_plain(row[column]) for row in tokens}))
        rests = Counter(tuple(map(_plain, row[:column] + row[column + 1 :])) for row in tokens)
        pairs = sum(times == 2 for times in rests.values())
        if counted in _COUNTED and max(rests.values()) == 2 and pairs >= max(_FEWEST_PAIRS, len(rests) / 2):
            first, second = counted
            told_by = f"{first} is taken for the left camera, {second} for the right one"
            yield told_by, _ColumnLook(column, (first, second))


def _schemes(
    names: Sequence[str], marks: tuple[str, str] | None
) -> Iterator[tuple[str, _Look | _ColumnLook]]:
    if marks is not None:
        left, right = (_without_accents(mark).lower() for mark in marks)
        pattern = re.compile("|".join(map(re.escape, (left, right))), re.IGNORECASE)
        yield (
            f"{marks[0]!r} is the left camera, {marks[1]!r} the right one",
            _Look(pattern, {left: 0, right: 1}),
        )
        return
    for words in _WORDS:
        used = {token.lower() for name in names for token in _TOKEN.findall(_stem(name))}
        shown = " and ".join(word for word in words if word in used)
        yield f"{shown} in the names tell the camera", _Look(_TOKEN, words)
    for pattern in (_NUMBERED, _NUMBERED_FOLDER):
        found = sorted({mark.group(0).lower() for name in names for mark in pattern.finditer(name)}, key=_key)
        if len(found) == 2:
            sides = {mark: side for side, mark in enumerate(found)}
            yield (
                f"{found[0]} is taken for the left camera, {found[1]} for the right one",
                _Look(pattern, sides),
            )
    yield from _columns(names)


def _no_sides(names: Sequence[str], marks: tuple[str, str] | None) -> str:
    """Say why the names do not tell the cameras, with what would help."""
    if marks is not None:
        return f"{names[0]} and others: {marks[0]!r} and {marks[1]!r} are not each in some names; look at --sides"
    words = [_TOKEN.findall(_stem(name)) for name in names]
    for column in zip(*words, strict=False):
        serials = Counter(column)
        if len(serials) == 2 and all(
            word.isdigit() and len(word) >= _LEAST_SERIAL_DIGITS and times > 1
            for word, times in serials.items()
        ):
            first, second = sorted(serials)
            return (
                f"{names[0]} and others: their names tell cameras {first} and {second}, but not which is the left one; "
                f"say so by --sides {first} {second}, the left one first"
            )
    return (
        f"{names[0]} and others: their names do not tell the left camera from the right one; name them as "
        "left_0003.png and right_0003.png (or L and R, cam0 and cam1, folders left and right), or say by --sides "
        "what they hold"
    )


def _all_told(times: Sequence[Mapping[str, int | None]]) -> bool:
    """Tell whether the names of both cameras hold times; one that many images share is that of the session."""
    for side in times:
        told = [time for time in side.values() if time is not None]
        if not told or len(told) <= len(side) / 2 or len(set(told)) < len(told):
            return False
    return True


def _by_time(moments: Sequence[Mapping[str, int]], tolerance_s: float) -> tuple[tuple[str, str], ...]:
    left, right = (sorted(side, key=side.__getitem__) for side in moments)
    stamps = [
        np.array([side[name] for name in order]) for side, order in zip(moments, (left, right), strict=True)
    ]
    # what differs by the tolerance is still within it, as far as a stamp in ns tells
    pairs = pair_by_time(stamps[0], stamps[1], tolerance_s * 1e9 + 1.0).index
    if not len(pairs):
        nearest_s = float(np.abs(stamps[0][:, None] - stamps[1]).min()) * 1e-9
        raise CalibrationError(
            f"{left[0]} and others: no image of one camera is within {tolerance_s * 1e3:g} ms of one of the other, the "
            f"nearest two are {nearest_s * 1e3:.4g} ms apart; give a larger --tolerance, or stamps of one clock"
        )
    return tuple((left[i], right[j]) for i, j in pairs.tolist())


def _by_key(sides: Sides, keys: Mapping[str, Key]) -> tuple[tuple[str, str], ...]:
    by_key: list[dict[Key, str]] = [{}, {}]
    for side, known in zip(sides, by_key, strict=True):
        for name in sorted(side):
            if (other := known.setdefault(keys[name], name)) != name:
                raise CalibrationError(
                    f"{other} and {name}: have the same number; remove or rename one of them"
                )
    left, right = by_key
    common = sorted(left.keys() & right.keys())
    if not common:
        raise CalibrationError(
            f"{min(sides[0])} and {min(sides[1])}: no image of one camera has the number of one of the other; name the "
            "two of one moment alike, as left_0003.png and right_0003.png"
        )
    return tuple((left[key], right[key]) for key in common)


def _keys(sides: Sides, rests: Mapping[str, str]) -> dict[str, Key]:
    """Return what tells the moment in each name: all of it but what is the same in all names of a camera."""
    keys = {name: _key(rests[name]) for side in sides for name in side}
    if len({len(key) for key in keys.values()}) > 1 or min(map(len, sides)) < 2:
        return keys
    columns = [list(zip(*(keys[name] for name in side), strict=True)) for side in sides]
    varying = [any(len(set(values)) > 1 for values in column) for column in zip(*columns, strict=True)]
    return {
        name: tuple(part for part, kept in zip(key, varying, strict=True) if kept)
        for name, key in keys.items()
    }


def _key(text: str) -> Key:
    """Return the words and numbers of a text, so that they compare as a person counts: 9 before 10, 3 as 0003."""
    return tuple(
        (0, int(token), "") if token.isdigit() else (1, 0, token.lower()) for token in _TOKEN.findall(text)
    )
