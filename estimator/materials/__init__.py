"""Hyperelastic laws, one small file each, and the table of them by name.

Other installed packages add theirs by an entry point of the group ``retract.materials`` that names an object with the
attributes of :class:`Law`.
"""

from collections.abc import Iterable, Mapping
from functools import cache
from types import MappingProxyType

from estimator.errors import InputError
from estimator.materials.arruda_boyce import ArrudaBoyce
from estimator.materials.gent import Gent
from estimator.materials.knowles import Knowles
from estimator.materials.law import Law
from estimator.materials.material import Material
from estimator.materials.mooney_rivlin import IsochoricMooneyRivlin, MooneyRivlin
from estimator.materials.neo_hookean import NeoHookean
from estimator.materials.ogden import Ogden1, Ogden2
from estimator.materials.st_venant_kirchhoff import StVenantKirchhoff
from estimator.materials.veronda_westmann import VerondaWestmann
from estimator.materials.yeoh import Yeoh
from estimator.plugins import Plugin, plugins

__all__ = [
    "LAWS",
    "NEO_HOOKEAN",
    "ArrudaBoyce",
    "Gent",
    "IsochoricMooneyRivlin",
    "Knowles",
    "Law",
    "MooneyRivlin",
    "NeoHookean",
    "Ogden1",
    "Ogden2",
    "StVenantKirchhoff",
    "VerondaWestmann",
    "Yeoh",
    "installed_laws",
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

# The law of the baseline; a fit gives it its E and ν.
NEO_HOOKEAN = Material(NeoHookean(), 1.0, 0.0)


ENTRY_POINTS = "retract.materials"


@cache
def installed_laws() -> Mapping[str, Law]:
    """Return the laws of this project and those of other installed packages, by name.

    Raises
    ------
    InputError
        Naming the package: what it declares cannot be imported, is no law, or has the name of another.
    """
    return with_plugins(LAWS, plugins(ENTRY_POINTS))


def with_plugins(laws: Mapping[str, Law], found: Iterable[Plugin]) -> Mapping[str, Law]:
    """Return a table of laws with those that packages declare.

    Raises
    ------
    InputError
        As :func:`installed_laws`.
    """
    table = dict(laws)
    for plugin in found:
        law = plugin.value() if isinstance(plugin.value, type) else plugin.value
        if not isinstance(law, Law):
            raise plugin.refused(
                f"{type(law).__name__} is no law; it needs name, shape_parameters and derivatives"
            )
        if law.name in table:
            raise plugin.refused(f"a law is called '{law.name}' already")
        table[law.name] = law
    return MappingProxyType(table)


def law_named(name: str) -> Law:
    """Return the law of that name.

    Raises
    ------
    InputError
        There is none.
    """
    # other packages are not asked for what this one has
    laws = LAWS if name in LAWS else installed_laws()
    if name not in laws:
        raise InputError(f"no law is called '{name}'; choose one of {', '.join(laws)}")
    return laws[name]
