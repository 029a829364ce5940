"""Who publishes a recording, and under which licence: what no device can tell."""

import re
from dataclasses import dataclass
from typing import Any

_ORCID = re.compile(r"(?:https://orcid\.org/)?(\d{4}-\d{4}-\d{4}-\d{3}[\dX])")
_WITH_IDENTIFIER = re.compile(r"(?P<name>.+?)\s*[<(](?P<identifier>[^<>()]+)[>)]")
_SPDX = re.compile(r"[A-Za-z0-9][A-Za-z0-9.+-]*")
_NO_LICENCE = "No licence was stated; ask the authors before any use."


@dataclass(frozen=True, slots=True)
class Publication:
    """What a crate says beside what was recorded.

    Attributes
    ----------
    authors : names, each with an ORCID behind it or without, as ``Ada Lovelace <0000-0002-1825-0097>``
    licence : identifier of the SPDX list such as ``CC-BY-4.0``, an address, or words; empty where none is stated
    """

    authors: tuple[str, ...] = ()
    licence: str = ""


def person(text: str) -> dict[str, Any]:
    """Return the entity of a person; an ORCID becomes its identifier."""
    match = _WITH_IDENTIFIER.fullmatch(text.strip())
    name, identifier = (match["name"], match["identifier"]) if match else (text.strip(), "")
    orcid = _ORCID.fullmatch(identifier.strip())
    if orcid:
        return {"@id": f"https://orcid.org/{orcid[1]}", "@type": "Person", "name": name}
    told = {"@id": f"#person-{slug(name)}", "@type": "Person", "name": name}
    return told | ({"identifier": identifier.strip()} if identifier else {})


def licence(text: str) -> tuple[Any, dict[str, Any] | None]:
    """Return the value of ``license`` of a crate, and the entity that it refers to, None where it is only words."""
    stated = text.strip()
    if not stated:
        return _NO_LICENCE, None
    if stated.startswith(("https://", "http://")):
        name, address = stated, stated
    elif _SPDX.fullmatch(stated):
        name, address = stated, f"https://spdx.org/licenses/{stated}"
    else:
        return stated, None
    described = {
        "name": name,
        "description": f"The data of this crate may be used under {name}; see {address}",
    }
    return {"@id": address}, {"@id": address, "@type": "CreativeWork", **described}


def slug(text: str) -> str:
    """Return a text as a part of an identifier within a crate."""
    return re.sub(r"[^A-Za-z0-9]+", "-", text).strip("-").lower() or "unnamed"
