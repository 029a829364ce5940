"""Hyperelastic laws, one small file each, and the table of them by name."""

from collections.abc import Mapping
from types import MappingProxyType

from estimator.errors import InputError
from estimator.materials.arruda_boyce import ArrudaBoyce
from estimator.materials.gent import Gent
from estimator.materials.law import Law
from estimator.materials.mooney_rivlin import IsochoricMooneyRivlin, MooneyRivlin
from estimator.materials.neo_hookean import NeoHookean
from estimator.materials.ogden import Ogden1, Ogden2
from estimator.materials.st_venant_kirchhoff import StVenantKirchhoff
from estimator.materials.veronda_westmann import VerondaWestmann
from estimator.materials.yeoh import Yeoh

__all__ = [
    "LAWS",
    "ArrudaBoyce",
    "Gent",
    "IsochoricMooneyRivlin",
    "Law",
    "MooneyRivlin",
    "NeoHookean",
    "Ogden1",
    "Ogden2",
    "StVenantKirchhoff",
    "VerondaWestmann",
    "Yeoh",
    "law_named",
]

_ALL: tuple[Law, ...] = (
    NeoHookean(),
    MooneyRivlin(),
    Yeoh(terms=2),
    Yeoh(terms=3),
    Gent(),
    ArrudaBoyce(),
    VerondaWestmann(),
    Ogden1(),
    Ogden2(),
    StVenantKirchhoff(),
)

LAWS: Mapping[str, Law] = MappingProxyType({law.name: law for law in _ALL})


def law_named(name: str) -> Law:
    """Return the law of that name.

    Raises
    ------
    InputError
        There is none.
    """
    if name not in LAWS:
        raise InputError(f"no law is called '{name}'; choose one of {', '.join(LAWS)}")
    return LAWS[name]
