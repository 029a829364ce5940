"""The commands in the documents: found, and read by the very programs that they call, without anything being done."""

import argparse
import re
import runpy
import shlex
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from unittest.mock import patch

ROOT = Path(__file__).resolve().parents[1]
DOCUMENTS = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
    ROOT / "robot_drivers" / "abb" / "rapid" / "README.md",
]
PROGRAMS = {"retract", "python", "python3", "py", "pytest", "ruff", "mypy"}
SYSTEM = {"export", "git", "ls", "sudo"}

_FENCE = re.compile(r"^ *```(\w*)\n(.*?)^ *```", re.MULTILINE | re.DOTALL)
_SPAN = re.compile(r"`([^`]+)`")
_REMARK = re.compile(r"\s{2,}.*|\s#.*")


@dataclass(frozen=True)
class Command:
    """A command of a document; ``whole`` where it stands on a line of its own, so that nothing may be missing."""

    document: str
    text: str
    whole: bool

    @property
    def words(self) -> list[str]:
        """What a shell would hand over, with something in the place of ``KIND``, and of ``N`` and its like."""
        return shlex.split(re.sub(r"\b[A-Z]\b", "1", self.text.replace("KIND", "netft")))


class CommandError(Exception):
    """What the program says to a command that it does not understand."""


class _Understood(Exception):  # noqa: N818 - it is no error
    """Nothing is wrong with the command; it is not carried out."""


def commands() -> list[Command]:
    """Every command of every document, in order."""
    return [
        command for path in DOCUMENTS for command in commands_of(path.read_text(encoding="utf-8"), path.name)
    ]


def commands_of(text: str, name: str) -> Iterator[Command]:
    """The commands of a text: lines of shell blocks and of indented ones, and spans of code in a sentence."""
    blocks = [(language, block) for language, block in _FENCE.findall(text)]
    rest = _FENCE.sub("", text)
    shell = [line for language, block in blocks if language in ("sh", "bash") for line in block.splitlines()]
    indented = [
        line for line in rest.splitlines() if line.startswith("    ") and _first(line) in PROGRAMS | SYSTEM
    ]
    for line in [*shell, *indented]:
        if bare := _REMARK.sub("", line.strip()):
            yield Command(name, bare, whole=True)
    prose = "\n".join(line for line in rest.splitlines() if line not in indented)
    for span in _SPAN.findall(prose):
        said = " ".join(span.split())
        if _first(said) in PROGRAMS and " " in said and not re.search(r"\||\.\.\.|VERB", said):
            yield Command(name, said, whole=False)


def understand(command: Command) -> None:
    """Have the program of a command read it.

    Raises
    ------
    CommandError
        It knows no such verb, module, option or value, or something is missing that has to be there.
    """
    program, *arguments = command.words
    if program in ("python3", "py") and arguments[:1] == ["run.py"]:
        program, arguments = (
            ("pytest", arguments[2:]) if arguments[1] == "test" else ("retract", arguments[1:])
        )
    if program == "retract":
        _read("daq.cli", arguments, command.whole)
    elif program == "python" and arguments[:2] == ["-m", "pip"]:
        return  # it reads its arguments as it goes
    elif program in ("python", "python3") and arguments[:1] == ["-m"]:
        _read(arguments[1], arguments[2:], command.whole)
    elif program in ("python", "python3") and arguments[:1] and arguments[0].endswith(".py"):
        _read(arguments[0], arguments[1:], command.whole)
    elif program == "pytest":
        for name in arguments:
            if name.startswith("tests/") and not (ROOT / name.partition("::")[0]).exists():
                raise CommandError(f"{name}: no such test")


def _read(program: str, arguments: list[str], whole: bool) -> None:
    """Run a module, or a file of the project, up to where it has understood its arguments."""
    path = ROOT / program if program.endswith(".py") else None
    if not (path.exists() if path else find_spec(program)):
        raise CommandError(f"{program}: no such module")
    original = argparse.ArgumentParser.parse_args

    def parse_args(parser: argparse.ArgumentParser, given: object = None, namespace: object = None) -> None:
        original(parser, given, namespace)  # type: ignore[arg-type] # handed on as it came
        raise _Understood

    def error(parser: argparse.ArgumentParser, message: str) -> None:
        if not whole and re.search("arguments are required|expected one argument", message):
            raise _Understood
        raise CommandError(f"{parser.prog}: {message}")

    with (
        patch.object(argparse.ArgumentParser, "parse_args", parse_args),
        patch.object(argparse.ArgumentParser, "error", error),
        patch.object(argparse.ArgumentParser, "print_help"),
        patch.object(sys, "argv", [program, *arguments]),
        warnings.catch_warnings(),
    ):
        # a module that another test has imported is run once more
        warnings.simplefilter("ignore", RuntimeWarning)
        try:
            if path:
                runpy.run_path(str(path), run_name="__main__")
            else:
                runpy.run_module(program, run_name="__main__", alter_sys=True)
        except _Understood:
            return
        except SystemExit as end:  # of --help
            if end.code in (0, None):
                return
            raise CommandError(f"{program} ended with status {end.code}") from end
    raise CommandError(f"{program} reads no arguments")


def _first(line: str) -> str:
    return line.split(maxsplit=1)[0] if line.split() else ""
