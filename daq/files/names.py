"""Names from a file that become names of files: they must not lead out of the folder that they are used in."""

import re

_FORBIDDEN = re.compile(r'[\x00-\x1f\x7f<>:"/\\|?*]')
_DEVICES = re.compile(r"(con|prn|aux|nul|com[1-9]|lpt[1-9])(\..*)?", re.IGNORECASE)
_LONGEST_BYTES = 200


def check_name(text: str, what: str) -> None:
    """Refuse a name that no system takes for a plain name of a file.

    Parameters
    ----------
    what : begins the message

    Raises
    ------
    ValueError
        It is empty, too long, begins or ends with a dot or a space, names a device of Windows, or holds a character
        that separates folders or that some system forbids.
    """
    plain = text.strip(". ") == text != "" and not _FORBIDDEN.search(text) and not _DEVICES.fullmatch(text)
    if not plain or len(text.encode("utf-8", "replace")) > _LONGEST_BYTES:
        raise ValueError(
            f"{what} {text[:40]!r} becomes the name of a file; write letters, digits, - and _, at most {_LONGEST_BYTES}"
        )
