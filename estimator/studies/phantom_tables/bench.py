"""The bench test of a phantom's silicone: a record of a tensile test, or a modulus with its deviation."""

from dataclasses import dataclass
from pathlib import Path

from estimator.errors import InputError
from estimator.input_file import parse_number
from estimator.materials import law_named
from estimator.uniaxial import fit_record, read_record


@dataclass(frozen=True, slots=True)
class BenchTest:
    """E of a phantom's silicone by another test, and its standard deviation, Pa."""

    phantom: str
    youngs_modulus_pa: float
    std_pa: float


def read_bench(text: str) -> BenchTest:
    """Read ``PHANTOM=E±S`` in Pa, or ``PHANTOM=FILE`` of a record as ``retract uniaxial`` reads it.

    Of a record E is that of the Neo-Hookean law over the strains that ``retract uniaxial`` fits.

    Raises
    ------
    InputError
        It is neither.
    """
    phantom, equals, value = text.partition("=")
    if not (equals and phantom.strip() and value.strip()):
        raise InputError(f"bench test '{text}': write PHANTOM=E±DEVIATION in Pa, or PHANTOM=FILE")
    for mark in ("±", "+-"):
        if mark in value:
            modulus, deviation = (_positive(part, text) for part in value.split(mark, 1))
            return BenchTest(phantom.strip(), modulus, deviation)
    fit = fit_record(read_record(Path(value.strip())), [law_named("neo_hookean")])
    found = fit.ranking[0].fit.youngs_modulus
    return BenchTest(phantom.strip(), found.value, found.std)


def _positive(part: str, text: str) -> float:
    try:
        value = parse_number(part.strip())
    except ValueError:
        value = -1.0
    if not value > 0:
        raise InputError(
            f"bench test '{text}': '{part.strip()}' is no number above zero; write E±DEVIATION in Pa"
        )
    return value
