"""What an Abaqus input file says, keyword by keyword ("Abaqus Keywords Reference Guide")."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from estimator.errors import InputError
from estimator.input_file import read_input_text
from estimator.meshes.volume_mesh import NODES, CellKind

_KINDS: Mapping[str, CellKind] = {
    "C3D4": "tet4",
    "C3D10": "tet10",
    "C3D5": "pyramid5",
    "C3D6": "wedge6",
    "C3D8": "hex8",
}
_UNREAD = ("CC3D", "CSS8", "SC6", "SC8")
_MAKES_NODES = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "SUBMODEL")
_MOST_BYTES = 500_000_000
_DEEPEST = 8

# Of a set: numbers of nodes or elements, and names of other sets.
Members = list[int | str]


@dataclass
class Part:
    """Nodes, elements and sets under the numbers of one part."""

    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    elements: dict[int, tuple[CellKind, tuple[int, ...]]] = field(default_factory=dict)
    node_sets: dict[str, Members] = field(default_factory=dict)
    element_sets: dict[str, Members] = field(default_factory=dict)


@dataclass
class Instance:
    """A part where it stands; ``placing`` are the lines that say so."""

    name: str
    part: str
    placing: list[list[float]] = field(default_factory=list)


@dataclass
class AssemblySet:
    """A set of nodes or elements of one instance, or of every one where none is named."""

    of_nodes: bool
    name: str
    instance: str
    members: Members = field(default_factory=list)


@dataclass
class Model:
    """What a file states: what lies in no part, the parts by their name in capitals, and where they stand."""

    flat: Part = field(default_factory=Part)
    parts: dict[str, Part] = field(default_factory=dict)
    instances: list[Instance] = field(default_factory=list)
    assembly_sets: list[AssemblySet] = field(default_factory=list)
    left_out: dict[str, int] = field(default_factory=dict)


def parse_inp(file: Path) -> Model:
    """Return what a file states.

    Raises
    ------
    InputError
        A file is missing, a keyword makes nodes or elements, or an element is cut short.
    ValueError, KeyError, IndexError
        A line is not written as its keyword wants it, or an element is of a kind that is not read.
    """
    parser = _Parser(Model())
    for name, number, text in _lines(file):
        if not text.startswith("*"):
            parser.data([word.strip() for word in text.rstrip(",").split(",")])
        elif parser.waiting:
            raise InputError(
                f"{name}: line {number}: the element before it is cut short; write the file again"
            )
        else:
            keyword, options = _keyword(text)
            if keyword in _MAKES_NODES:
                raise InputError(
                    f"{name}: line {number}: *{keyword} is not read; write the mesh out, with its nodes and elements"
                )
            parser.begin(keyword, options)
    if parser.waiting:
        raise InputError(f"{file}: its last element is cut short; copy the file again")
    return parser.model


class _Parser:
    """Takes keywords and their data lines one after the other."""

    def __init__(self, model: Model) -> None:
        self.model = model
        # words of an element that goes on in the next line
        self.waiting = list[str]()
        self._part, self._in_assembly = model.flat, False
        self._keyword, self._options = "", dict[str, str]()
        self._members: Members = []

    def begin(self, keyword: str, options: dict[str, str]) -> None:
        self._keyword, self._options = keyword, options
        if keyword == "PART":
            self._part = self.model.parts.setdefault(options["NAME"].upper(), Part())
        elif keyword == "END PART":
            self._part = self.model.flat
        elif keyword in ("ASSEMBLY", "END ASSEMBLY"):
            self._in_assembly = keyword == "ASSEMBLY"
        elif keyword == "INSTANCE":
            self.model.instances.append(Instance(options["NAME"], options["PART"].upper()))
        elif keyword in ("NSET", "ELSET"):
            self._members = self._set(keyword == "NSET", options[keyword])

    def data(self, words: list[str]) -> None:
        if self._keyword == "INSTANCE":
            self.model.instances[-1].placing.append([float(word) for word in words])
        elif self._keyword == "NODE":
            x, y, z = (float(word) for word in [*words[1:4], "0", "0"][:3])
            self._part.nodes[int(words[0])] = (x, y, z)
            if "NSET" in self._options:
                self._part.node_sets.setdefault(self._options["NSET"], []).append(int(words[0]))
        elif self._keyword == "ELEMENT":
            self.waiting = self._element([*self.waiting, *words])
        elif self._keyword in ("NSET", "ELSET"):
            self._members += _members(words, "GENERATE" in self._options)

    def _set(self, of_nodes: bool, name: str) -> Members:
        if self._in_assembly:
            self.model.assembly_sets.append(AssemblySet(of_nodes, name, self._options.get("INSTANCE", "")))
            return self.model.assembly_sets[-1].members
        return (self._part.node_sets if of_nodes else self._part.element_sets).setdefault(name, [])

    def _element(self, words: list[str]) -> list[str]:
        """Add an element, or return its words where it goes on in the next line."""
        name, left_out = self._options["TYPE"].upper(), self.model.left_out
        kind = _kind(name)
        if kind is None:
            left_out[name] = left_out.get(name, 0) + 1
            return []
        if len(words) < 1 + NODES[kind]:
            return words
        number = int(words[0])
        if len(words) > 1 + NODES[kind]:
            raise ValueError(f"element {number} of type {name} has {len(words) - 1} nodes")
        if number in self._part.elements:
            raise ValueError(f"element {number} stands there twice")
        self._part.elements[number] = (kind, tuple(int(word) for word in words[1:]))
        if "ELSET" in self._options:
            self._part.element_sets.setdefault(self._options["ELSET"], []).append(number)
        return []


def _lines(file: Path, depth: int = 0) -> Iterator[tuple[str, int, str]]:
    """Yield file, number and text of each line that is no comment, with those of files that are included."""
    if depth > _DEEPEST:
        raise InputError(f"{file}: files include each other without end; remove *INCLUDE")
    for number, line in enumerate(read_input_text(file, _MOST_BYTES).splitlines(), start=1):
        text = line.strip()
        if not text or text.startswith("**"):
            continue
        if text.upper().startswith("*INCLUDE"):
            _, options = _keyword(text)
            yield from _lines(file.parent / options.get("INPUT", ""), depth + 1)
            continue
        yield str(file), number, text


def _keyword(text: str) -> tuple[str, dict[str, str]]:
    first, *rest = text[1:].split(",")
    options = {}
    for option in rest:
        name, _, value = option.partition("=")
        options[name.strip().upper()] = value.strip().strip('"')
    return " ".join(first.upper().split()), options


def _members(words: Iterable[str], generate: bool) -> Members:
    given: Members = [int(word) if word.lstrip("+").isdecimal() else word for word in words if word]
    if not generate:
        return given
    start, stop, step = (*(int(one) for one in given), 1)[:3]
    return list(range(start, stop + 1, step))


def _kind(name: str) -> CellKind | None:
    if name.startswith(_UNREAD):
        raise ValueError(f"elements of type {name}; read are {', '.join(_KINDS)}")
    for start, kind in _KINDS.items():
        if name.startswith(start) and not name[len(start) : len(start) + 1].isdigit():
            return kind
    if name.startswith("C3D"):
        raise ValueError(f"elements of type {name}; read are {', '.join(_KINDS)}")
    return None
