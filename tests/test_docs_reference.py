"""Every docstring is one that the reference can show; the whole reference takes minutes, this a few seconds."""

import ast
import io
import re
import runpy
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from doc_commands import ROOT
from docutils.frontend import Values, get_default_settings
from docutils.nodes import literal
from docutils.parsers.rst import Parser, roles
from docutils.utils import new_document

# What has a single line without any of these is shown as it stands.
MARKS = re.compile(r"[`*_|\\\n]")
ROOMS = ("robot_drivers", "estimator", "daq", "gui")
SITE = ROOT / "docs" / "site"
as_written = runpy.run_path(str(SITE / "plain_docstrings.py"))["as_written"]
SETTINGS = runpy.run_path(str(SITE / "conf.py"))
NAPOLEON = {name: value for name, value in SETTINGS.items() if name.startswith("napoleon_")}


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """A node and all statements within, without the expressions of which they are made."""
    yield node
    for child in ast.iter_child_nodes(node):
        if isinstance(child, (ast.stmt, ast.ExceptHandler, ast.match_case)):
            yield from statements(child)


@cache
def parser_settings() -> Values:
    """What to complain of; to make them takes as long as to parse a docstring."""
    for role in ("class", "mod", "meth", "func", "data", "attr", "exc"):
        roles.register_generic_role(role, literal)
    return get_default_settings(Parser)


def docstrings(path: Path) -> Iterator[tuple[str, str]]:
    """Each name of a module with its docstring."""
    for node in statements(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and (
            text := ast.get_docstring(node)
        ):
            yield getattr(node, "name", "module"), text


def complaints(docstring: str) -> str:
    """What the parser says of a docstring; roles of Sphinx are taken as they come."""
    from sphinx.ext.napoleon import Config, NumpyDocstring

    text = str(NumpyDocstring(as_written(docstring.splitlines()), Config(**NAPOLEON)))
    said = io.StringIO()
    settings = parser_settings().copy()
    settings.report_level, settings.halt_level, settings.warning_stream = 2, 5, said
    Parser().parse(text, new_document("a docstring", settings))
    return said.getvalue()


@pytest.mark.parametrize("room", ROOMS)
def test_every_docstring_of_a_room_can_be_shown(room: str) -> None:
    found = {
        f"{path.relative_to(ROOT)}: {name}": complaint
        for path in sorted((ROOT / room).rglob("*.py"))
        for name, text in docstrings(path)
        if MARKS.search(text) and (complaint := complaints(text))
    }
    assert found == {}


@pytest.mark.parametrize(
    "docstring", ["A ``half quotation.", "* an item\nthat ends too soon", "A :class:`half role."]
)
def test_one_that_cannot_be_shown_would_be_found(docstring: str) -> None:
    assert complaints(docstring)


@pytest.mark.parametrize(
    ("docstring", "shown"),
    [
        ("The energy is\n\n    W = |x|\n\nwith |x| at rest.", "    W = |x|\n\nwith \\|x\\| at rest."),
        ("Errors:\n\nBase\n└── One", "::\n\n    Base\n    └── One"),
        ("Names ``a | b``.", "Names ``a | b``."),
        ("- an item\n\n    goes on", "- an item\n\n    goes on"),
        ("Shown.\n\nSignals\n-------\ntold : a line", "Signals\n-------\ntold\n    a line"),
    ],
)
def test_a_docstring_is_shown_as_it_is_written(docstring: str, shown: str) -> None:
    assert "\n".join(as_written(docstring.splitlines())).endswith(shown)
