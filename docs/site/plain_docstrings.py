"""Docstrings are plain text that reads as it stands; this tells Sphinx which of it is a formula, code or a drawing.

An indented block after a blank line is shown as it is written, so is a tree drawn with lines, and a bar is a bar (of an
absolute value). What stands behind a name in a section is what is said of it.
"""

import re
from typing import Any

from sphinx.application import Sphinx

# before napoleon, which hears the same event, reads the sections
_FIRST = 100


def setup(app: Sphinx) -> dict[str, Any]:
    """Have every docstring read by :func:`as_written`."""
    app.connect("autodoc-process-docstring", _process, priority=_FIRST)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def as_written(lines: list[str]) -> list[str]:
    """Return the lines of a docstring as reStructuredText that shows them as they are."""
    paragraphs = re.split(r"\n{2,}", "\n".join(lines).strip("\n"))
    out: list[str] = []
    in_sections = False
    for number, paragraph in enumerate(paragraphs):
        in_sections = in_sections or re.search(r"^-{3,}$", paragraph, re.M) is not None
        drawn = re.search("[├└]──", paragraph) is not None
        literal = drawn or (number > 0 and not in_sections and _is_block(paragraph, out))
        if literal and not out[-1].endswith("::"):
            out.append("::" if drawn or not out[-1].startswith(" ") else "")
        shown = re.sub("^", "    ", paragraph, flags=re.M) if drawn else paragraph
        if in_sections:
            shown = re.sub(r"^([\w, *]+) : (.+)$", r"\1\n    \2", shown, flags=re.M)
        out.append(shown if literal else _with_bars(shown))
    return "\n\n".join(part for part in out if part).split("\n")


def _process(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    lines[:] = [*as_written(lines), ""]  # autodoc sets members directly below


def _is_block(paragraph: str, before: list[str]) -> bool:
    """Tell whether a paragraph is an indented block, and not what goes on below an item of a list."""
    of_a_list = re.match(r"[-*] |\d+\. ", before[-1].rpartition("\n\n")[2]) is not None
    return paragraph.startswith("    ") and not of_a_list


def _with_bars(text: str) -> str:
    """Return a text with its bars escaped but where they are code."""
    parts = re.split(r"(``.*?``)", text, flags=re.S)
    return "".join(part if part.startswith("``") else part.replace("|", "\\|") for part in parts)
