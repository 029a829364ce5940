"""The text of a file in whatever encoding a machine's program wrote it."""

import codecs
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from estimator.errors import InputError
from estimator.input_file import MOST_TEXT_BYTES, read_input
from estimator.uniaxial.reading.language.vocabulary import COLUMN_WORDS, MODE_WORDS, SIZE_WORDS, UNITS
from estimator.uniaxial.reading.language.words import has_word

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig", "UTF-8"),
    (codecs.BOM_UTF32_LE, "utf-32", "UTF-32"),
    (codecs.BOM_UTF32_BE, "utf-32", "UTF-32"),
    (codecs.BOM_UTF16_LE, "utf-16", "UTF-16"),
    (codecs.BOM_UTF16_BE, "utf-16", "UTF-16"),
)
_OLDER: Mapping[str, str] = MappingProxyType(
    {
        "cp1252": "Windows-1252 (Western Europe)",
        "cp850": "code page 850 (Western Europe, DOS)",
        "cp1250": "Windows-1250 (Central Europe)",
        "cp1251": "Windows-1251 (Cyrillic)",
        "cp932": "Shift JIS (Japanese)",
        "gb18030": "GB 18030 (Chinese)",
        "cp949": "Windows-949 (Korean)",
    }
)
_KNOWN_WORDS = (
    *(
        word
        for words in (COLUMN_WORDS, SIZE_WORDS, MODE_WORDS)
        for entries in words.values()
        for word in entries
    ),
    *(unit for units in UNITS.values() for unit in units),
)
_FOREIGN_WORD = re.compile(r"[^\W\d_]*[^\x00-\x7f]\S*")
_END_OF_FILE = b"\x1a"  # that DOS programs write
_OLD_OFFICE = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_SAMPLE = 4000
_MOST_WORDS = 100
_ZEROS_IN_UTF16 = 0.4  # of the bytes, in the texts of machines


def decoded(file: Path) -> tuple[str, str]:
    """Return the text of a file and the name of its encoding.

    UTF-8, UTF-16 and UTF-32 are told by their byte-order mark, UTF-16 without one by its zero bytes; of the older
    encodings that in which the most words are known, the first of those that are equal.

    Raises
    ------
    InputError
        It cannot be read, or is no text.
    """
    content = read_input(file, MOST_TEXT_BYTES).rstrip(_END_OF_FILE)
    if content.startswith(_OLD_OFFICE):
        raise InputError(
            f"{file}: is an .xls file or another of old office programs; save it as .xlsx or CSV"
        )
    encoding, name = _encoding(content)
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        raise InputError(
            f"{file}: byte {error.start} is no text in {name}; export it again as text in UTF-8"
        ) from None
    odd = next((one for one in text if _is_control(one)), None)
    if odd is not None:
        raise InputError(
            f"{file}: holds zero bytes or other control characters ({odd!r}), which no text has; export it as text"
        )
    return text, name


def _encoding(content: bytes) -> tuple[str, str]:
    for mark, encoding, name in _MARKS:
        if content.startswith(mark):
            return encoding, name
    sample = content[:_SAMPLE]
    if sample and sample.count(0) > _ZEROS_IN_UTF16 * len(sample):
        odd = sample[1::2].count(0) > sample[::2].count(0)
        return ("utf-16-le" if odd else "utf-16-be"), "UTF-16"
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return ("utf-8", "UTF-8") if 0 in content else _older_encoding(content)
    return "utf-8", "UTF-8"


def _older_encoding(content: bytes) -> tuple[str, str]:
    known: dict[str, int] = {}
    for encoding in _OLDER:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        words = {
            word for line in text.split("\n") if not line.isascii() for word in _FOREIGN_WORD.findall(line)
        }
        if not any(map(_is_control, text)):
            known[encoding] = sum(has_word(word, _KNOWN_WORDS) for word in sorted(words)[:_MOST_WORDS])
    best = max(known, key=lambda each: known[each], default="cp1252")
    return best, _OLDER[best]


def _is_control(one: str) -> bool:
    # C1 controls too: text in an encoding that is not the supposed one has them
    return (one < " " and one not in "\t\r\n\f") or ("\x7f" <= one < "\xa0" and one != "\x85")
