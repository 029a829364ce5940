"""What may cause a gap between a bench test and a Neo-Hookean specimen, with priors on how large it is.

A parameter is exp(ln m + z ln f) or m + z f with z standard normal: how large an effect is spans decades. An onset is
equally likely anywhere in the test.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.special import ndtr

from estimator.materials import LAWS
from estimator.uniaxial.diagnosis.rows import Rows
from estimator.uniaxial.diagnosis.specimen import Specimen
from estimator.uniaxial.records import FloatArray

NONE, UNKNOWN = "none", "unknown"
_OF_STRAIN = (
    "strain_stiffening",
    "stress_softening",
    "permanent_set",
    "slack",
    "machine_compliance",
    "clamp_slip",
    "platen_friction",
)
_SPECTRUM_TERMS = 6
_OF_UNLOADING = ("stress_softening", "permanent_set")


@dataclass(frozen=True, slots=True)
class Prior:
    """Of one parameter.

    Attributes
    ----------
    name, unit : of the parameter
    middle, spread : median and factor of one deviation; mean and deviation where it is normal
    kind : how z becomes the parameter
    upper : largest value
    """

    name: str
    unit: str
    middle: float
    spread: float
    kind: Literal["lognormal", "normal", "anywhere"] = "lognormal"
    upper: float = np.inf

    def value(self, z: float) -> float:
        """Return the parameter that belongs to a standard normal z."""
        if self.kind == "anywhere":
            return self.middle + self.spread * float(ndtr(z))
        if self.kind == "normal":
            return self.middle + self.spread * z
        return min(self.middle * self.spread**z, self.upper)


@dataclass(frozen=True, slots=True)
class Form:
    """One form of a cause: its parameters, that of its size first, and what they do to a specimen."""

    label: str
    name: str
    priors: tuple[Prior, ...]
    change: Callable[[Specimen, Sequence[float]], Specimen]

    def applied(self, specimen: Specimen, z: FloatArray) -> Specimen:
        """Return the specimen with this cause."""
        return self.change(
            specimen, [prior.value(float(one)) for prior, one in zip(self.priors, z, strict=True)]
        )


def forms_for(tests: Sequence[Rows]) -> tuple[Form, ...]:
    """Return the forms that these tests can show."""
    missing = not_shown(tests)
    reach = max(float(rows.strain.max()) for rows in tests)
    families: tuple[tuple[str, Callable[[], list[Form]]], ...] = (
        ("strain_stiffening", lambda: _laws(tests)),
        ("stress_softening", _softening),
        ("permanent_set", _permanent_set),
        ("slack", lambda: _slack(reach)),
        ("viscoelasticity", lambda: _relaxation(tests)),
        ("machine_compliance", _of_machine),
        ("clamp_slip", lambda: _of_clamps(reach)),
        ("platen_friction", _of_platens),
    )
    return tuple(form for label, forms in families if label not in missing for form in forms())


def not_shown(tests: Sequence[Rows]) -> dict[str, str]:
    """Return the causes that these tests cannot show, and why."""
    found = {}
    if all(np.ptp(rows.strain) == 0 for rows in tests):
        found = dict.fromkeys(_OF_STRAIN, "strain does not change")
    elif all(rows.part[-1] == 0 for rows in tests):
        found = dict.fromkeys(_OF_UNLOADING, "no test goes back")
    if any(rows.test.time is None for rows in tests):
        found["viscoelasticity"] = "a test has no column of time"
    if all(rows.test.mode == "compression" for rows in tests):
        found["clamp_slip"] = "platens have no clamps"
    if all(rows.test.strain_on_specimen for rows in tests):
        found |= dict.fromkeys(("machine_compliance", "clamp_slip"), "strain was measured on the specimen")
    if not any(rows.test.mode == "compression" for rows in tests):
        found["platen_friction"] = "no test is a compression"
    return found


def _laws(tests: Sequence[Rows]) -> list[Form]:
    invariant = max(_first_invariant(rows) for rows in tests)
    scales = {
        "yeoh2": (Prior("c2", "", 0.3 / invariant, 4.0),),
        "gent": (Prior("inverse_limit", "", 0.2 / invariant, 2.5, upper=0.995 / invariant),),
        "veronda_westmann": (Prior("exponent", "", 0.4 / invariant, 4.0),),
        "ogden1": (Prior("exponent", "", 2.0, 2.0, "normal"),),
        "mooney_rivlin": (Prior("second_invariant_share", "", 0.0, 0.4, "normal"),),
    }
    return [Form("strain_stiffening", name, priors, _with_law(name)) for name, priors in scales.items()]


def _with_law(name: str) -> Callable[[Specimen, Sequence[float]], Specimen]:
    law = LAWS[name]
    rest = tuple(parameter.null for parameter in law.shape_parameters[1:])
    return lambda specimen, values: replace(specimen, law=law, shape=(values[0], *rest))


def _first_invariant(rows: Rows) -> float:
    if rows.test.mode == "shear":
        return float(np.max(rows.strain**2))
    sign = 1.0 if rows.test.mode == "tension" else -1.0
    stretch = np.maximum(1 + sign * rows.strain, 0.02)
    return float(np.max(stretch**2 + 2 / stretch - 3))


def _relaxation(tests: Sequence[Rows]) -> list[Form]:
    longest = max(float(rows.time[-1]) for rows in tests)
    shortest = min(float(np.median(np.diff(rows.time))) for rows in tests)
    shortest = min(max(shortest, 1e-4 * longest), 0.1 * longest)
    middle, spread = float(np.sqrt(longest * shortest)), float((longest / shortest) ** 0.3)
    share = Prior("relaxing_share", "of the stress that stays", 0.3, 3.0, upper=20.0)
    time = Prior("relaxation_time", "s", middle, spread)
    decades = Prior("decades", "", 2.0, 1.6, upper=6.0)

    def one(specimen: Specimen, values: Sequence[float]) -> Specimen:
        return replace(specimen, relaxation=((values[0], values[1]),))

    def spectrum(specimen: Specimen, values: Sequence[float]) -> Specimen:
        times = values[1] * 10 ** (values[2] * np.linspace(-0.5, 0.5, _SPECTRUM_TERMS))
        return replace(specimen, relaxation=tuple((values[0] / _SPECTRUM_TERMS, float(t)) for t in times))

    return [
        Form("viscoelasticity", "one time", (share, time), one),
        Form("viscoelasticity", "spectrum", (share, time, decades), spectrum),
    ]


def _softening() -> list[Form]:
    priors = (
        Prior("softened_share", "", 0.25, 2.0, upper=0.95),
        Prior("energy", "of the largest", 0.3, 3.0),
    )
    return [
        Form("stress_softening", "Ogden-Roxburgh", priors, lambda s, v: replace(s, softening=(v[0], v[1])))
    ]


def _permanent_set() -> list[Form]:
    prior = Prior("set", "of the largest strain", 0.06, 2.0, upper=0.9)
    return [Form("permanent_set", "share", (prior,), lambda s, v: replace(s, permanent_set=v[0]))]


def _slack(reach: float) -> list[Form]:
    prior = Prior("slack", "strain", 0.05 * reach, 3.0, upper=0.7 * reach)
    return [Form("slack", "slack", (prior,), lambda s, v: replace(s, slack=v[0]))]


def _of_machine() -> list[Form]:
    prior = Prior("compliance", "of the specimen's", 0.15, 2.5, upper=5.0)
    return [Form("machine_compliance", "spring", (prior,), lambda s, v: replace(s, compliance=v[0]))]


def _of_clamps(reach: float) -> list[Form]:
    onset = Prior("onset", "strain", 0.0, reach, "anywhere")
    creeping = (Prior("slipping_share", "of the travel", 0.2, 2.0, upper=0.95), onset)
    sudden = (Prior("slip", "strain", 0.05 * reach, 2.5, upper=0.8 * reach), onset)
    return [
        Form("clamp_slip", "creeping", creeping, lambda s, v: replace(s, creeping_slip=(v[0], v[1]))),
        Form("clamp_slip", "sudden", sudden, lambda s, v: replace(s, sudden_slip=(v[0], v[1]))),
    ]


def _of_platens() -> list[Form]:
    sliding = (
        Prior("friction", "coefficient", 0.2, 2.0, upper=1.5),
        Prior("turning_strain", "strain", 0.01, 3.0),
    )
    held = (Prior("held_share", "of the faces", 0.4, 2.0, upper=2.0),)
    return [
        Form("platen_friction", "sliding", sliding, lambda s, v: replace(s, sliding_friction=(v[0], v[1]))),
        Form("platen_friction", "held", held, lambda s, v: replace(s, held_faces=v[0])),
    ]
