"""Convergence of every kind of element to the reference solutions, at both Poisson's ratios."""

from collections.abc import Callable, Iterator

from benchmarks.pull import PULL, errors, quadratic_tetrahedra, reference, solve_pull, tissue, unknowns
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.discretisation.elements import ElementKind
from estimator.forward.gradings import DEFAULT_GRADING, FINE_GRADING
from estimator.forward.meshing import mesh_experiment
from estimator.studies.paper_tables.densities import CELLS
from estimator.studies.paper_tables.tetrahedra import block_of_tetrahedra

_COARSE = Grading(grasp_m=4e-3, anchor_m=8e-3, largest_m=20e-3, growth=2.0, layers=1)
_MIDDLE = Grading(grasp_m=2e-3, anchor_m=6e-3, largest_m=12e-3, growth=2.0, layers=1)
_LAYERED = Grading(grasp_m=1e-3, anchor_m=3e-3, largest_m=6e-3, growth=1.5, layers=2)


def lines() -> Iterator[str]:
    """Give a line for each mesh: largest errors over all steps of force and fiducials."""
    yield "mesh                              unknowns   force, %: nu 0.35  nu 0.49   fiducials, um: nu 0.35  nu 0.49"
    for name, posed in _meshes():
        problem = posed()
        found = [errors(problem, solve_pull(problem, tissue(nu)), reference(nu)) for nu in (0.35, 0.49)]
        force = "".join(f"{100 * error:9.2f}" for error, _ in found)
        fiducials = "".join(f"{1e6 * error:9.0f}" for _, error in found)
        yield f"{name:34s}{unknowns(problem):8d}{force:>27s}{fiducials:>31s}"


def _meshes() -> Iterator[tuple[str, Callable[[], RetractionProblem]]]:
    for name, cells in CELLS.items():
        yield f"tet4, uniform, {name} density", lambda cells=cells: block_of_tetrahedra(PULL, cells)  # type: ignore[misc]
    yield "tet10, uniform, low density", lambda: quadratic_tetrahedra(CELLS["low"])
    yield "hex8, graded, 2 layers", _hexahedra(_LAYERED, "hex8")
    for words, grading in (
        ("coarse", _COARSE),
        ("middle", _MIDDLE),
        ("default", DEFAULT_GRADING),
        ("fine", FINE_GRADING),
    ):
        yield f"hex27, graded, {words}", _hexahedra(grading, "hex27")
    yield "hex64, graded, coarse", _hexahedra(_COARSE, "hex64")
    yield "hex64, graded, middle", _hexahedra(_MIDDLE, "hex64")


def _hexahedra(grading: Grading, kind: ElementKind) -> Callable[[], RetractionProblem]:
    return lambda: mesh_experiment(PULL, grading, kind)
