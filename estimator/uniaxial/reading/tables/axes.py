"""Channels of several axes, such as Fx, Fy and Fz: which of them the test loads."""

import re
from collections.abc import Sequence

from estimator.uniaxial.reading.language.words import folded

_WITHOUT_BRACKETS = re.compile(r"[(\[{][^()\[\]{}]*[)\]}]")
_AXIS_AT_AN_END = re.compile(r"^([xyz])\1?(.*)$|^(.*?)([xyz])\4?$")


def of_several_axes(titles: Sequence[str]) -> list[int]:
    """Return the places of titles that differ from the first in nothing but the letter of an axis.

    Examples
    --------
    >>> of_several_axes(["Fx (N)", "Fy (N)", "Fz (N)", "Load (N)"])
    [0, 1, 2]
    >>> of_several_axes(["XForce_mN", "YForce_mN"]), of_several_axes(["exx", "eyy", "exy"])
    ([0, 1], [0, 1])
    >>> of_several_axes(["Load (N)", "Load 2 (N)"])
    [0]
    """
    parted = [_parted(title) for title in titles]
    stem, axis = parted[0]
    if not axis:
        return [0]
    return [place for place, (other, letter) in enumerate(parted) if other == stem and letter]


def _parted(title: str) -> tuple[str, str]:
    """Return a title without the letter of its axis, and the letter; none where it names none or several."""
    letters, words = [], []
    for word in re.split(r"[\s_:;,.\-]+", folded(_WITHOUT_BRACKETS.sub(" ", title))):
        found = _AXIS_AT_AN_END.match(word)
        if found is None:
            words.append(word)
            continue
        letters.append(found[1] or found[4])
        words.append(found[2] if found[1] else found[3])
    return (" ".join(words), letters[0]) if len(letters) == 1 else (title, "")
