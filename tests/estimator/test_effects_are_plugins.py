"""What is particular to one effect stands in its file alone: the sources name no label, and no block of the rig."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from test_architecture import MODULES, imported_by

from estimator.effects import standard
from estimator.effects.blocks import GROUPS

LABELS = {effect.label for effect in standard.EFFECTS}
# Words that name a group or a block and nothing else; "force", "grasp" or "material" are anybody's.
BLOCKS = {"interior", "support", "inhomogeneity"} & ({*GROUPS} | {block.name for block in GROUPS.values()})
# The blind benchmark has simulators and words of its own, a uniaxial record has causes of its own.
OF_THEIR_OWN = ("estimator.blind.", "estimator.uniaxial.")


def strings(path: Path) -> Iterator[tuple[int, str]]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, node.value


def names_one(words: set[str], path: Path) -> list[int]:
    return [line for line, text in strings(path) if text in words]


def of_effects(module: str) -> bool:
    return module.startswith("estimator.effects.")


OTHERS = [module for module in MODULES if not of_effects(module) and not module.startswith(OF_THEIR_OWN)]


def test_the_scan_sees_a_label_in_a_table_and_not_in_a_sentence(tmp_path: Path) -> None:
    source = tmp_path / "module.py"
    source.write_text('"""On gripper_slip."""\nTABLE = {"gripper_slip": "hold tighter"}\n', encoding="utf-8")
    assert names_one({"gripper_slip"}, source) == [2]


@pytest.mark.parametrize("words", [LABELS, BLOCKS], ids=["label", "block"])
def test_no_module_but_an_effect_s_own_names_it(words: set[str]) -> None:
    assert words
    assert {m: found for m in OTHERS if (found := names_one(words, MODULES[m]))} == {}


def test_a_label_is_written_in_one_file() -> None:
    files: dict[str, list[str]] = {label: [] for label in LABELS}
    for module in filter(of_effects, MODULES):
        for _, text in strings(MODULES[module]):
            # "inhomogeneity" is a group as well
            if text in files and text not in GROUPS and module not in files[text]:
                files[text].append(module)
    assert {label: found for label, found in files.items() if len(found) != 1 and label not in GROUPS} == {}


def test_only_the_list_of_effects_and_outsiders_know_single_ones() -> None:
    knowing = {
        module
        for module in MODULES
        for name in imported_by(module)
        if any(name.startswith(f"estimator.effects.{kind}.") for kind in KINDS)
    }
    assert {module for module in knowing if not module.startswith(MAY_KNOW)} == set()


KINDS = ("tissue", "mounting", "motion", "force", "vision", "outside")
MAY_KNOW = (
    "estimator.effects.",
    # errors that a fit is asked about
    "estimator.fit.identifiability",
    "estimator.fit.budget.systematic",
    # how the edges of the grasp, where meshes differ, may move
    "estimator.diagnosis.",
    # the words of a sample answer
    "daq.bad_input.samples",
)
