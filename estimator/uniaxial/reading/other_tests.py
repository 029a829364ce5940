"""Whether a file is of a test that neither pulls nor pushes, whose curve no uniaxial law describes."""

from collections.abc import Sequence
from dataclasses import dataclass

from estimator.errors import InputError
from estimator.uniaxial.reading.cells.grid import Row
from estimator.uniaxial.reading.facts import speaks_of_test
from estimator.uniaxial.reading.language.vocabulary import OTHER_TEST_WORDS, OtherTest
from estimator.uniaxial.reading.language.words import has_word


@dataclass(frozen=True, slots=True)
class ToldOtherwise:
    """A kind of test that is no tension and no compression, what tells it, and what to do if that is wrong."""

    kind: OtherTest
    reason: str
    remedy: str


def other_test(titles: Sequence[str], above: Sequence[Row], name: str) -> ToldOtherwise | None:
    """Return what the titles of the used columns, a line on the test, or the file's name tells."""
    lines = [": ".join(row.filled[:2]) for row in above if speaks_of_test(row)]
    told = [
        *((title, "column", "name the column otherwise") for title in titles),
        *((line, "line", "add --mode") for line in lines),
        (name, "name", "add --mode"),
    ]
    for text, place, remedy in told:
        for kind, words in OTHER_TEST_WORDS.items():
            if has_word(text, words):
                return ToldOtherwise(kind, f"the {place} {text!r}", remedy)
    return None


def refuse_other_test(told: ToldOtherwise | None, where: str, more: str = "") -> None:
    """Refuse a test that is no tension and no compression.

    Parameters
    ----------
    more : what else reads it

    Raises
    ------
    InputError
        It is one.
    """
    if told is not None:
        raise InputError(
            f"{where}: {told.reason} tells a {told.kind} test, and none of tension or compression with free "
            f"sides{more}; {told.remedy} if it is one after all"
        )
