import ast
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("robot_drivers", "estimator", "daq", "gui")
QT = {"PySide6", "pyqtgraph"}
FORBIDDEN_IMPORTS = {
    "robot_drivers": {"estimator", "daq", "gui", "tests"} | QT,
    "estimator": {"robot_drivers", "daq", "gui", "tests", "cv2", "serial", "can"} | QT,
    "daq": {"gui", "tests"} | QT,
    "gui": {"tests"},
}
MOST_LINES = 300
MOST_MODULES_IN_A_FOLDER = 15
MOST_PARAMETERS = 6
# What scripts and notebooks call: each keyword is one wish of theirs, and none need be known that is not used.
CALLED_BY_SCRIPTS = (
    "estimator.api.diagnosing.diagnose",
    "estimator.api.estimating.estimate",
    "estimator.api.simulating.simulate",
)
SIMULATED = re.compile(r"emulators?$|^virtual_|^testing$")
CHOOSES_SIMULATION = re.compile(
    r"(daq\.(bad_input|cli|demo|faults)|gui\.(app|promptness|soak|screenshots)|robot_drivers\.ati\.benchmark)\b"
)
MACHINE_PATH = re.compile(
    r"(?<![\w.:/$}>-])/(home|root|Users|opt|mnt|media|srv|work|workspace)/\w|\b[A-Z]:\\+Users"
)
UNFINISHED = re.compile(r"\b(TODO|FIXME|XXX|HACK)\b")


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def modules_below(*folders: str) -> dict[str, Path]:
    return {module_name(path): path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))}


MODULES = modules_below(*ROOMS)
SOURCES = {**MODULES, **modules_below("benchmarks"), "run": ROOT / "run.py"}


def imports(tree: ast.Module, module: str, is_package: bool = False) -> Iterator[str]:
    """Every module that a source imports, anywhere in it; ``from a import b`` gives ``a.b``."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = module.split(".")
            parents = parents[: len(parents) - node.level + is_package] if node.level else []
            base = ".".join([*parents, *filter(None, [node.module])])
            yield from (f"{base}.{alias.name}" for alias in node.names)


@dataclass(frozen=True)
class Function:
    """A function of a module: how many parameters it has, and how many returns."""

    name: str
    parameters: int
    returns: int


@dataclass(frozen=True)
class Written:
    """What is asked about a module, read off its source once."""

    imports: frozenset[str]
    has_docstring: bool
    functions: tuple[Function, ...]


@cache
def written(module: str) -> Written:
    path = SOURCES[module]
    tree = ast.parse(path.read_text(encoding="utf-8"), filename=module)
    return Written(
        frozenset(imports(tree, module, path.name == "__init__.py")),
        ast.get_docstring(tree) is not None,
        tuple(functions(tree)),
    )


def imported_by(module: str) -> frozenset[str]:
    return written(module).imports


def own_module(name: str) -> str | None:
    """The module of this project that an imported name lies in; a name may be a class or a function."""
    while name and name not in MODULES:
        name = name.rpartition(".")[0]
    return name or None


def modules_of(room: str) -> list[str]:
    return [module for module in MODULES if module.split(".")[0] == room]


def is_simulated(module: str) -> bool:
    return any(SIMULATED.search(part) for part in module.split("."))


def test_the_reader_of_imports_sees_nested_and_relative_ones() -> None:
    source = "import a.b\ndef f():\n    from ..c import d\nfrom . import e\n"
    assert set(imports(ast.parse(source), "room.sub.module")) == {"a.b", "room.c.d", "room.sub.e"}
    package = ast.parse("from . import e\nfrom .f import g")
    assert set(imports(package, "room.sub", is_package=True)) == {
        "room.sub.e",
        "room.sub.f.g",
    }


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_what_it_may_know(room: str) -> None:
    assert modules_of(room)
    found = {module: {name.split(".")[0] for name in imported_by(module)} for module in modules_of(room)}
    assert {
        m: roots & FORBIDDEN_IMPORTS[room] for m, roots in found.items() if roots & FORBIDDEN_IMPORTS[room]
    } == {}


def test_what_runs_on_the_real_rig_never_imports_a_simulated_device() -> None:
    found = {
        (module, name)
        for module in MODULES
        if not is_simulated(module) and not CHOOSES_SIMULATION.match(module)
        for name in imported_by(module)
        if is_simulated(own_module(name) or "")
    }
    assert found == set()


def test_no_module_imports_itself_through_others() -> None:
    assert circle_of((module, own) for module in MODULES for own in own_modules_imported_by(module)) == ""


def test_packages_import_each_other_in_one_direction() -> None:
    packages = {module.rpartition(".")[0] for module in MODULES} - {""}
    circles = {package: circle_of(imports_between_parts_of(package)) for package in sorted(packages)}
    assert {package: circle for package, circle in circles.items() if circle} == {}


def test_a_circle_is_told() -> None:
    assert circle_of([("a", "b"), ("b", "c"), ("c", "b")]) in (
        "b imports c imports b",
        "c imports b imports c",
    )
    assert circle_of([("a", "b"), ("a", "c"), ("b", "c")]) == ""


def circle_of(imported: Iterable[tuple[str, str]]) -> str:
    """Who imports itself through others, empty where nobody does."""
    sorter: TopologicalSorter[str] = TopologicalSorter()
    for module, other in imported:
        sorter.add(module, other)
    try:
        sorter.prepare()
    except CycleError as error:
        return " imports ".join(reversed(error.args[1]))
    return ""


def own_modules_imported_by(module: str) -> set[str]:
    return {own for name in imported_by(module) if (own := own_module(name))}


def imports_between_parts_of(package: str) -> Iterator[tuple[str, str]]:
    """The imports between what lies directly in a package: its modules, and packages within it as a whole."""
    parts = len(package.split(".")) + 1
    for module in modules_within(package):
        for other in own_modules_imported_by(module):
            part, of_other = (".".join(name.split(".")[:parts]) for name in (module, other))
            if other.startswith(f"{package}.") and part != of_other:
                yield part, of_other


def test_a_module_is_short_enough_to_be_read_in_one_sitting() -> None:
    lines = {module: len(path.read_text(encoding="utf-8").splitlines()) for module, path in SOURCES.items()}
    assert {module: count for module, count in lines.items() if count > MOST_LINES} == {}


def test_a_folder_holds_no_more_modules_than_one_keeps_in_mind() -> None:
    held = Counter(path.parent for path in SOURCES.values() if path.name != "__init__.py")
    too_many = {folder: count for folder, count in held.items() if count > MOST_MODULES_IN_A_FOLDER}
    assert {str(folder.relative_to(ROOT)): count for folder, count in too_many.items()} == {}


def test_a_function_asks_for_few_things() -> None:
    found = [
        (f"{module}.{function.name}", function.parameters)
        for module in SOURCES
        for function in written(module).functions
        if function.parameters > MOST_PARAMETERS
    ]
    assert [function for function in found if function[0] not in CALLED_BY_SCRIPTS] == []


def test_parameters_are_counted_but_for_the_object_itself() -> None:
    source = "class A:\n    def f(self, a, /, b, *args, c=0, **more): ...\nasync def g(a): ...\n"
    assert {one.name: one.parameters for one in functions(ast.parse(source))} == {"f": 3, "g": 1}


def functions(tree: ast.Module) -> Iterator[Function]:
    """Each function in a source; the object or class of a method is no parameter."""
    for node in ast.walk(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            names = [one.arg for one in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
            yield Function(node.name, len(names) - (names[:1] in (["self"], ["cls"])), returns_of(node))


def returns_of(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Returns of a function, without those of functions within it."""
    pending: list[ast.AST] = list(function.body)
    found = 0
    while pending:
        node = pending.pop()
        if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda)):
            found += isinstance(node, ast.Return)
            pending += ast.iter_child_nodes(node)
    return found


def test_the_counter_of_returns_leaves_out_those_of_inner_functions() -> None:
    source = "def f(a):\n    def g():\n        return 1\n    if a:\n        return g\n    return None\n"
    assert {one.name: one.returns for one in functions(ast.parse(source))} == {"f": 2, "g": 1}


def test_a_module_begins_with_what_it_is_for() -> None:
    assert [module for module in MODULES if not written(module).has_docstring] == []


def source_files() -> Iterator[Path]:
    yield from (
        ROOT / name for name in ("README.md", "pyproject.toml", "requirements.lock", "run.py", ".ci/run")
    )
    for folder in (*ROOMS, "tests"):
        yield from (
            path
            for path in (ROOT / folder).rglob("*")
            if path.suffix in {".py", ".toml", ".md", ".mod", ".sys"}
        )


@pytest.mark.parametrize("pattern", [MACHINE_PATH, UNFINISHED], ids=["machine-path", "unfinished"])
def test_no_file_names_a_machine_or_an_unfinished_thing(pattern: re.Pattern[str]) -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in source_files()
        if path != Path(__file__).resolve()
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if pattern.search(line)
    ]
    assert found == []


# From the bottom to the top; nothing is imported from a layer above.
LAYERS_OF_THE_DIAGNOSIS = (
    "declared_numbers",
    "settings",
    "settings_page",
    "model",
    "sensitivity",
    "noise",
    "fitting",
    "evidence",
    "search",
    "screened",
    "result",
    "conclusions",
    "what_if",
    "diagnose",
)


def test_the_layers_of_the_diagnosis_import_downwards_only() -> None:
    upwards = {
        (module, name)
        for module in modules_within("estimator.diagnosis")
        for name in imported_by(module)
        if name.startswith("estimator.diagnosis.") and layer_of(name) > layer_of(module)
    }
    assert upwards == set()


def modules_within(package: str) -> list[str]:
    return [module for module in MODULES if module.startswith(f"{package}.")]


def layer_of(module: str) -> int:
    return LAYERS_OF_THE_DIAGNOSIS.index(module.split(".")[2])


def test_what_every_inference_shares_knows_none_of_them() -> None:
    above = (
        "estimator.fit",
        "estimator.diagnosis",
        "estimator.effects",
        "estimator.simulation",
        "estimator.studies",
        "estimator.report",
    )
    found = {
        (module, name)
        for module in modules_within("estimator.inference")
        for name in imported_by(module)
        if name.startswith(above)
    }
    assert found == set()


# Returns of functions that have more than one, of all that a case runs through in the diagnosis: each but the last of a
# function is an early exit, a case apart. Returns of functions within functions count as those of their own.
MOST_RETURNS_OF_SEVERAL = 55
BESIDE_THE_WAY = ("settings_page", "what_if", "declared_numbers")


def test_a_case_goes_through_the_diagnosis_with_few_cases_apart() -> None:
    several = {
        (module, function.name): function.returns
        for module in modules_within("estimator.diagnosis")
        if module.split(".")[2] not in BESIDE_THE_WAY
        for function in written(module).functions
        if function.returns > 1
    }
    assert sum(several.values()) <= MOST_RETURNS_OF_SEVERAL, several
