"""Comparing a file's words with those of the vocabulary: without case, accents and punctuation."""

import re
import unicodedata
from collections.abc import Iterable

_WORD = re.compile(r"[^\s_,;:()\[\]{}\"'=]+")


def folded(text: str) -> str:
    """Return a text without case and accents: ``Höhe`` is ``hohe``; ``ß`` is ``ss``."""
    decomposed = unicodedata.normalize("NFKD", text.casefold())
    return " ".join("".join(one for one in decomposed if not unicodedata.combining(one)).split())


def words_of(text: str) -> list[str]:
    """Return the words of a text, folded; underscores and brackets part them."""
    return _WORD.findall(folded(text))


def has_word(text: str, entries: Iterable[str]) -> bool:
    """Tell whether a text holds one of the words, or a phrase of several."""
    return first_word(text, entries) is not None


def first_word(text: str, entries: Iterable[str]) -> int | None:
    """Return the place, among the entries, of the first that a text holds; None where it holds none."""
    words = [part for word in words_of(text) for part in {word, *re.split(r"[/.\-–]", word)} if part]
    phrase = f" {' '.join(words_of(text))} "
    for place, entry in enumerate(entries):
        if " " in entry:
            found = f" {entry} " in phrase
        elif entry.startswith("*"):
            found = any(word.endswith(entry[1:]) for word in words)
        elif entry.endswith("*"):
            found = any(word.startswith(entry[:-1]) for word in words)
        elif not entry.isascii() and len(entry) > 1:
            found = folded(entry) in phrase
        else:
            found = folded(entry) in words
        if found:
            return place
    return None
