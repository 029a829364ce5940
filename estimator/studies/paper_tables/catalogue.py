"""The studies of the paper's sections IV and VI by name."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from estimator.errors import InputError
from estimator.studies.paper_tables.block_estimates import complex_motion, mesh_density
from estimator.studies.paper_tables.grasp_error import grasp_error
from estimator.studies.paper_tables.liver import liver
from estimator.studies.paper_tables.motion_noise import motion_noise
from estimator.studies.paper_tables.rough_surface import rough_surface
from estimator.studies.tables.study import Study

ALL = "all"
DRAWS = 20
_MOST_RELIEFS = 3

# A study with so many draws, where it draws.
STUDIES: Mapping[str, Callable[[int], Study]] = MappingProxyType(
    {
        "table1": lambda draws: mesh_density(),
        "table2": lambda draws: rough_surface(range(min(draws, _MOST_RELIEFS))),
        "table3": grasp_error,
        "table4": motion_noise,
        "table5": lambda draws: complex_motion(),
        "liver": lambda draws: liver(),
    }
)


def studies_named(names: Sequence[str], draws: int = DRAWS) -> list[Study]:
    """Return the studies of these names, or "all", each once.

    Raises
    ------
    InputError
        A name is unknown, or there is no draw.
    """
    if draws < 1:
        raise InputError(f"{draws} draws; at least one is needed")
    chosen = list(STUDIES) if ALL in names else list(dict.fromkeys(names))
    if unknown := [name for name in chosen if name not in STUDIES]:
        raise InputError(f"no study is called '{unknown[0]}'; choose of {', '.join(STUDIES)}, {ALL}")
    return [STUDIES[name](draws) for name in chosen]
