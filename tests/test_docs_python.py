"""Every block of Python in the documents: run where the page says nothing else, in a folder with what it reads."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest
from doc_commands import DOCUMENTS, ROOT
from retraction_cases import SMALL_BLOCK, follow, from_rest, recorded, straight_pull

from estimator.experiment import write_experiment
from estimator.fem.equilibrium.newton import EquilibriumSolver
from estimator.fem.equilibrium.observation import observe
from estimator.forward.meshing import mesh_experiment
from estimator.materials import law_named
from estimator.materials.material import make_material

_BLOCK = re.compile(r"(?:<!-- not run: (?P<why>[^>]+) -->\n+)?^```python\n(?P<code>.*?)^```", re.M | re.S)
BLOCKS = [
    pytest.param(found["code"], found["why"], id=f"{path.relative_to(ROOT).as_posix()}-{number}")
    for path in DOCUMENTS
    for number, found in enumerate(_BLOCK.finditer(path.read_text(encoding="utf-8")))
]


@pytest.fixture(scope="module")
def workplace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the experiment ``soft/pull`` that the pages speak of, of a small phantom."""
    folder = tmp_path_factory.mktemp("python")
    problem = mesh_experiment(SMALL_BLOCK)
    material = make_material(law_named("neo_hookean"), 15e3, 0.45, [])
    poses = straight_pull(SMALL_BLOCK, 0.012, 4)
    states = [EquilibriumSolver(problem).rest(material), *follow(problem, material, poses)]
    seen = [observe(problem, state) for state in states]
    experiment = recorded(SMALL_BLOCK, from_rest(SMALL_BLOCK, poses), seen, np.random.default_rng(0))
    write_experiment(experiment, folder / "soft" / "pull")
    return folder


def carry_out(code: str, name: str, imports_alone: bool) -> None:
    """Run a block as a script, or only what it imports."""
    tree = ast.parse(code, name)
    if imports_alone:
        tree.body = [node for node in tree.body if isinstance(node, (ast.Import, ast.ImportFrom))]
    exec(compile(tree, name, "exec"), {"__name__": "__main__"})


def test_there_are_blocks() -> None:
    assert len(BLOCKS) >= 3


@pytest.mark.parametrize(("code", "why"), BLOCKS)
def test_a_block_runs_or_says_why_not(
    code: str, why: str | None, workplace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(workplace)
    carry_out(code, "a block of the documents", imports_alone=why is not None)


@pytest.mark.parametrize(
    "code", ["import estimator.nowhere\n", "from estimator.errors import Nothing\nrig()\n"]
)
def test_a_block_that_is_not_run_is_found_if_its_imports_are_wrong(code: str) -> None:
    with pytest.raises(ImportError):
        carry_out(code, "a block", imports_alone=True)
