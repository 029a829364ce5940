"""What only some systems have is asked for only there: read off the sources, so that no such machine is needed.

Which names of the standard library a system lacks is read from typeshed, the stubs that come with mypy.
"""

import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
_MYPY = find_spec("mypy")  # found, not imported: only its files are read
assert _MYPY is not None
assert _MYPY.origin is not None
STUBS = Path(_MYPY.origin).parent / "typeshed" / "stdlib"
HERE = "linux"
ELSEWHERE = ("win32", "darwin")
SOURCES = [ROOT / "run.py"] + [
    path
    for room in ("robot_drivers", "estimator", "daq", "gui", "benchmarks")
    for path in sorted((ROOT / room).rglob("*.py"))
]

# Names whose value is a question about the system; asking one of them is a guard.
QUESTIONS = {"sys.platform", "os.name", "hasattr", "getattr", "KERNEL_STAMPS", "_RAW", "WINDOWS"}

# What is reached only through a guard in another place, and which one.
GUARDED_ELSEWHERE = {
    ("robot_drivers/serial_line/emulator/line.py", "PseudoTerminal"): "far_end makes it, off Windows only",
    ("robot_drivers/abb/egm/udp.py", "_receive_stamped"): "chosen where KERNEL_STAMPS says so",
    ("robot_drivers/ati/rdt/receiver.py", "_receive_stamped"): "chosen where KERNEL_STAMPS says so",
    (
        "robot_drivers/kernel_stamps.py",
        "_stamped_on_arrival",
    ): "stamps are asked for where KERNEL_STAMPS says so",
    ("run.py", "install_system_packages"): "returns at its start unless on Linux",
}


def stub(module: str) -> Path | None:
    """The stub of a module of the standard library."""
    place = STUBS / module.replace(".", "/")
    found = (place / "__init__.pyi", place.with_suffix(".pyi"))
    return next((path for path in found if path.exists()), None)


def holds(test: ast.expr, platform: str) -> bool:
    """Whether the condition of a stub holds on a platform, with this Python."""
    match test:
        case ast.BoolOp(op=ast.And(), values=values):
            return all(holds(value, platform) for value in values)
        case ast.BoolOp(op=ast.Or(), values=values):
            return any(holds(value, platform) for value in values)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return not holds(operand, platform)
    return bool(eval(ast.unparse(test).replace("sys.platform", repr(platform)), {"sys": sys}))


def names_of(body: list[ast.stmt], platform: str) -> Iterator[str]:
    """The names that the statements of a stub define on a platform; members of classes as ``Class.member``."""
    for node in body:
        match node:
            case ast.If():
                yield from names_of(node.body if holds(node.test, platform) else node.orelse, platform)
            case ast.ClassDef():
                yield node.name
                yield from (f"{node.name}.{member}" for member in names_of(node.body, platform))
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                yield node.name
            case ast.Assign():
                yield from (target.id for target in node.targets if isinstance(target, ast.Name))
            case ast.AnnAssign(target=ast.Name(id=name)):
                yield name
            case ast.Import() | ast.ImportFrom():
                yield from (alias.asname or alias.name for alias in node.names)


@cache
def names(module: str, platform: str) -> frozenset[str]:
    """What a module of the standard library offers on a platform; nothing where there is no such module."""
    path = stub(module)
    if path is None:
        return frozenset()
    return frozenset(names_of(ast.parse(path.read_text(encoding="utf-8")).body, platform))


@cache
def is_absent(module: str, platform: str) -> bool:
    """Whether a module that this system has is missing on another one."""
    public = [name for name in names(module, platform) if not name.startswith("_") and name != "sys"]
    offered = {name for name in names(module, HERE) if not name.startswith("_")} - {"sys"}
    imported_only = {"Final", "final", "structseq", "Any", "Callable", "IO", "FileDescriptorLike"}
    return bool(offered - imported_only) and not set(public) - imported_only


SOCKET_METHODS = {
    name.removeprefix("socket.")
    for platform in ELSEWHERE
    for name in names("socket", HERE) - names("socket", platform)
    | names("_socket", HERE) - names("_socket", platform)
    if name.startswith("socket.")
}


@dataclass
class Finder(ast.NodeVisitor):
    """Collects what a source asks of the standard library without asking first whether the system has it."""

    platform: str
    guarded: frozenset[str]
    modules: dict[str, str] = field(default_factory=dict)
    depth: int = 0
    found: list[tuple[int, str]] = field(default_factory=list)

    def visit_Import(self, node: ast.Import) -> None:
        for alias in node.names:
            self.modules[alias.asname or alias.name] = alias.name
            if is_absent(alias.name, self.platform):
                self._tell(node, alias.name)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        for alias in node.names if node.module and not node.level else ():
            if self._lacks(node.module or "", alias.name):
                self._tell(node, f"{node.module}.{alias.name}")

    def visit_Attribute(self, node: ast.Attribute) -> None:
        module = self.modules.get(dotted(node.value))
        if module is not None and self._lacks(module, node.attr):
            self._tell(node, f"{module}.{node.attr}")
        elif module is None and node.attr in SOCKET_METHODS and self.platform == "win32":
            self._tell(node, f"socket.{node.attr}")
        self.generic_visit(node)

    def visit_If(self, node: ast.If | ast.IfExp) -> None:
        self.visit(node.test)
        self.depth += _asks(node.test)
        for child in [*_listed(node.body), *_listed(node.orelse)]:
            self.visit(child)
        self.depth -= _asks(node.test)

    visit_IfExp = visit_If  # noqa: N815 - the name is that of the visitor

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        """A function that leaves at once where the system is another is guarded from there on."""
        before = self.depth
        self.depth += node.name in self.guarded
        for child in node.body:
            self.visit(child)
            if (
                isinstance(child, ast.If)
                and _asks(child.test)
                and isinstance(child.body[-1], ast.Return | ast.Raise)
            ):
                self.depth += 1
        self.depth = before

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self.depth += node.name in self.guarded
        self.generic_visit(node)
        self.depth -= node.name in self.guarded

    def _lacks(self, module: str, name: str) -> bool:
        return name in names(module, HERE) and name not in names(module, self.platform)

    def _tell(self, node: ast.stmt | ast.expr, name: str) -> None:
        if not self.depth:
            self.found.append((node.lineno, name))


def dotted(node: ast.expr) -> str:
    """The dotted name that an expression is, empty where it is another one."""
    match node:
        case ast.Name():
            return node.id
        case ast.Attribute() if before := dotted(node.value):
            return f"{before}.{node.attr}"
    return ""


def _asks(test: ast.expr) -> bool:
    asked = ast.unparse(test)
    return any(question in asked for question in QUESTIONS)


def _listed(part: list[ast.stmt] | ast.expr) -> list[ast.AST]:
    return list(part) if isinstance(part, list) else [part]


def unguarded(tree: ast.Module, platform: str, guarded: frozenset[str] = frozenset()) -> list[str]:
    finder = Finder(platform, guarded)
    finder.visit(tree)
    return [name for _, name in finder.found]


@dataclass(frozen=True)
class Asked:
    """What a source asks of the system."""

    unguarded: dict[str, list[str]]  # by the platform that lacks it
    without_encoding: list[int]
    forked: list[int]


@pytest.fixture(scope="module")
def asked() -> dict[str, Asked]:
    """Each source, read once, and gone through only for what it names at all."""
    found = {}
    for path in SOURCES:
        name = path.relative_to(ROOT).as_posix()
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text)
        guarded = frozenset(inside for file, inside in GUARDED_ELSEWHERE if file == name)
        lacking = {platform: unguarded(tree, platform, guarded) for platform in ELSEWHERE}
        found[name] = Asked(
            lacking,
            without_encoding(tree) if any(one in text for one in OPENS) else [],
            forked(tree) if any(one in text for one in STARTS) else [],
        )
    return found


@pytest.mark.parametrize(
    ("source", "lacking"),
    [
        ("import resource", ["resource"]),
        ("from fcntl import flock", ["fcntl.flock"]),
        ("import os\nos.nice(5)", ["os.nice"]),
        ("import socket\ns = socket.socket()\ns.recvmsg(1)", ["socket.recvmsg"]),
        ("import signal\nsignal.signal(signal.SIGPROF, f)", ["signal.SIGPROF"]),
        ("import os, sys\nif sys.platform != 'win32':\n    os.nice(5)", []),
        ("import os, sys\nx = os.nice(5) if sys.platform != 'win32' else 0", []),
        ("import os, sys\ndef f():\n    if sys.platform == 'win32':\n        return\n    os.nice(5)", []),
        (
            "import os, sys\ndef f():\n    os.nice(5)\n    if sys.platform == 'win32':\n        return",
            ["os.nice"],
        ),
        ("import os\nif hasattr(os, 'nice'):\n    os.nice(5)", []),
        ("import os\nos.fsync(3)\nos.kill(1, 2)", []),
    ],
)
def test_the_finder_sees_what_windows_lacks(source: str, lacking: list[str]) -> None:
    assert unguarded(ast.parse(source), "win32") == lacking


@pytest.mark.parametrize("platform", ELSEWHERE)
def test_what_a_system_lacks_is_asked_for_only_elsewhere(asked: dict[str, Asked], platform: str) -> None:
    found = {name: one.unguarded[platform] for name, one in asked.items()}
    assert {name: lacking for name, lacking in found.items() if lacking} == {}


def test_what_is_guarded_elsewhere_is_still_there() -> None:
    for file, inside in GUARDED_ELSEWHERE:
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        assert inside in {n.name for n in ast.walk(tree) if isinstance(n, ast.ClassDef | ast.FunctionDef)}


# Where what is read or written is ASCII in every encoding, and why.
ASCII_ALONE = {
    "run.py": "a digest",
    "daq/virtual_rig/benchmark.py": "what Linux tells of a process",
    "daq/acquisition/silence.py": "what Linux tells of a process",
    "gui/soak/meter.py": "what Linux tells of a process",
}


OPENS = ("open", "read_text", "write_text")
STARTS = ("get_context", "set_start_method")


def without_encoding(tree: ast.Module) -> list[int]:
    """Lines on which a text is read or written in whatever encoding the system prefers."""
    found = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or any(word.arg == "encoding" for word in node.keywords):
            continue
        name = node.func.attr if isinstance(node.func, ast.Attribute) else ast.unparse(node.func)
        modes = [
            one.value for one in node.args if isinstance(one, ast.Constant) and isinstance(one.value, str)
        ]
        text_mode = bool(modes) and set(modes[0]) <= set("rwaxt+")
        if (name == "open" and text_mode) or name in OPENS[1:]:
            found.append(node.lineno)
    return found


@pytest.mark.parametrize(
    ("source", "lines"),
    [
        ("path.read_text()", [1]),
        ("path.write_text('x')", [1]),
        ("path.open('w')", [1]),
        ("open('name', 'rb')", []),
        ("path.open('ab')", []),
        ("path.read_text(encoding='utf-8')", []),
        ("path.open('a', encoding='utf-8')", []),
    ],
)
def test_the_finder_sees_a_text_without_an_encoding(source: str, lines: list[int]) -> None:
    assert without_encoding(ast.parse(source)) == lines


def test_every_text_has_its_encoding_stated(asked: dict[str, Asked]) -> None:
    """Windows prefers another one."""
    found = {name for name, one in asked.items() if one.without_encoding}
    assert found <= ASCII_ALONE.keys()


def forked(tree: ast.Module) -> list[int]:
    """Lines on which processes are made in another way than by starting Python anew."""
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and dotted(node.func).endswith(STARTS)
        and [ast.unparse(argument) for argument in node.args] not in (["'spawn'"], ["'forkserver'"])
    ]


def test_the_finder_sees_a_fork() -> None:
    assert forked(ast.parse("import multiprocessing as m\nm.get_context('spawn')\nm.get_context()")) == [3]


def test_no_process_is_forked(asked: dict[str, Asked]) -> None:
    """Windows cannot, and a fork of a process with threads may hang."""
    assert {name: one.forked for name, one in asked.items() if one.forked} == {}
