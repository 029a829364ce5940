"""Which test would part two causes that a record does not tell apart."""

from collections.abc import Mapping
from types import MappingProxyType

_PARTING: Mapping[str, str] = MappingProxyType(
    {
        "strain_stiffening": "an unloading and a second cycle, with strain measured on the specimen: a law comes back",
        "viscoelasticity": "a hold of strain, and the same test at a tenth of the rate",
        "stress_softening": "a second cycle to the same strain and one to a larger one, at the same rate",
        "permanent_set": "the specimen's length measured after unloading and after an hour's rest",
        "slack": "a start from a slight preload, with the length measured there",
        "machine_compliance": "an extensometer or marks on the specimen, or a stiff block in place of it",
        "clamp_slip": "marks on the specimen at the edge of the clamps",
        "platen_friction": "the same with lubricated platens, or with a slimmer cylinder",
        "unknown": "the same test once more, to see whether the gap comes again",
    }
)


def parting_tests(labels: tuple[str, ...]) -> list[str]:
    """Return the tests that part these causes from each other."""
    return [_PARTING[label] for label in dict.fromkeys(labels) if label in _PARTING]
