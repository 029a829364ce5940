"""The text of a file in whatever encoding a machine's program wrote it."""

import codecs
from pathlib import Path

from estimator.errors import InputError
from estimator.input_file import MOST_TEXT_BYTES, read_input

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig", "UTF-8"),
    (codecs.BOM_UTF32_LE, "utf-32", "UTF-32"),
    (codecs.BOM_UTF32_BE, "utf-32", "UTF-32"),
    (codecs.BOM_UTF16_LE, "utf-16", "UTF-16"),
    (codecs.BOM_UTF16_BE, "utf-16", "UTF-16"),
)
_SAMPLE = 4000
_ZEROS_IN_UTF16 = 0.4  # of the bytes, in the texts of machines


def decoded(file: Path) -> tuple[str, str]:
    """Return the text of a file and the name of its encoding.

    UTF-8, UTF-16 and UTF-32 are told by their byte-order mark, UTF-16 without one by its zero bytes; what is no UTF-8
    is taken for the encoding of Western Europe.

    Raises
    ------
    InputError
        It cannot be read, or is no text.
    """
    content = read_input(file, MOST_TEXT_BYTES)
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
        return ("utf-8", "UTF-8") if 0 in content else ("cp1252", "Windows-1252 (Western Europe)")
    return "utf-8", "UTF-8"


def _is_control(one: str) -> bool:
    # C1 controls too: text in an encoding that is not the supposed one has them
    return (one < " " and one not in "\t\r\n\f") or ("\x7f" <= one < "\xa0" and one != "\x85")
