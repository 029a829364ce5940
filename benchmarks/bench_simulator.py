"""Bench tests with a known cause, written from textbook formulas and apart from the forward model of the diagnosis.

A record is cycles of growing reach. How large a cause is comes in three sizes, about which a seed draws; it draws the
modulus, the reach, the number of cycles and the noise as well.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.special import erf

from estimator.uniaxial.diagnosis import BenchMode, BenchTest

FloatArray = NDArray[np.float64]
Size = Literal["small", "medium", "large"]
SIZES: tuple[Size, ...] = ("small", "medium", "large")
_ROWS_OF_STROKE = 80
_SCATTER_OF_SIZE = 1.25


@dataclass(frozen=True, slots=True)
class Protocol:
    """How a specimen is tested.

    Attributes
    ----------
    modulus : Young's, Pa
    reach : largest strain
    cycles : of growing reach
    rate : of strain, 1/s
    noise : of the load, of the largest
    mode : of loading
    """

    modulus: float = 30e3
    reach: float = 0.4
    cycles: int = 3
    rate: float = 0.01
    noise: float = 0.005
    mode: BenchMode = "tension"

    @property
    def strain(self) -> FloatArray:
        """Strain (n,) of the machine."""
        ways = []
        for number in range(1, self.cycles + 1):
            top = self.reach * number / self.cycles
            ways += [
                np.linspace(0, top, _ROWS_OF_STROKE, endpoint=False),
                np.linspace(top, 0, _ROWS_OF_STROKE, endpoint=False),
            ]
        return np.concatenate(ways)

    @property
    def time(self) -> FloatArray:
        """Time (n,), s."""
        return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self.strain)))]) / self.rate

    def elastic(self, strain: FloatArray) -> FloatArray:
        """Magnitude of a Neo-Hookean specimen's nominal stress (n,), Pa."""
        if self.mode == "shear":
            return self.modulus / 3 * strain
        sign = 1.0 if self.mode == "tension" else -1.0
        stretch = 1 + sign * strain
        return np.asarray(sign * self.modulus / 3 * (stretch - stretch**-2))

    def energy(self, strain: FloatArray) -> FloatArray:
        """Strain energy density (n,) of a Neo-Hookean specimen, J/m³."""
        return self.modulus / 6 * self.excess(strain)

    def excess(self, strain: FloatArray) -> FloatArray:
        """First invariant less three (n,)."""
        if self.mode == "shear":
            return strain**2
        stretch = 1 + strain if self.mode == "tension" else 1 - strain
        return np.asarray(stretch**2 + 2 / stretch - 3)


Made = Callable[[Protocol, float, np.random.Generator], FloatArray]


def clean(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """Nothing but the law."""
    del size, rng
    return test.elastic(test.strain)


def fung(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """W = μ/2b (exp(b (I1 - 3)) - 1), the stress at the largest strain being ``1 + size`` times the Neo-Hookean."""
    del rng
    excess = test.excess(test.strain)
    return test.elastic(test.strain) * (1 + size) ** (excess / excess.max())


def arruda_boyce(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """Five terms of the eight-chain series (J. Mech. Phys. Solids 41 (1993) 389), as stiff at the end as Fung's."""
    del rng
    excess = test.excess(test.strain)
    coefficients = np.array([1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750])

    def stiffer(limit: float) -> FloatArray:
        terms = [n * c * ((excess + 3) / limit) ** (n - 1) for n, c in enumerate(coefficients, start=1)]
        at_rest = sum(n * c * (3 / limit) ** (n - 1) for n, c in enumerate(coefficients, start=1))
        return np.asarray(sum(terms) / at_rest)

    limits = np.geomspace(0.05, 1000.0, 400)
    ends = np.array([stiffer(float(limit)).max() for limit in limits])
    return test.elastic(test.strain) * stiffer(float(limits[np.argmin(np.abs(ends - 1 - size))]))


def maxwell(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """A spring beside a Maxwell element, as the differential equation q' = P' - q/τ."""
    time = float(np.exp(rng.uniform(np.log(2.0), np.log(30.0))))
    at, elastic = test.time, test.elastic(test.strain)

    def rate(t: float, q: FloatArray) -> FloatArray:
        place = min(int(np.searchsorted(at, t, side="right")), len(at) - 1)
        slope = (elastic[place] - elastic[place - 1]) / (at[place] - at[place - 1])
        return np.asarray(slope - q / time)

    longest = float(at[-1]) / 300
    solved = solve_ivp(rate, (0.0, float(at[-1])), [0.0], t_eval=at, max_step=longest, atol=1e-3)
    branch = np.asarray(solved.y[0], dtype=np.float64)
    return _borne(test, elastic + size * branch)


def stretched_exponential(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """Kohlrausch, Williams and Watts: G(t) = 1 + size exp(-(t/τ)^0.5)."""
    time = float(np.exp(rng.uniform(np.log(3.0), np.log(30.0))))
    at, steps = test.time, np.diff(test.elastic(test.strain), prepend=0.0)
    lag = np.maximum(at[:, None] - at, 0.0)
    modulus = np.tril(1 + size * np.exp(-np.sqrt(lag / time)))
    return _borne(test, np.asarray(modulus @ steps))


def _borne(test: Protocol, stress: FloatArray) -> FloatArray:
    """Return what a specimen bears: a strip that has grown too long hangs, a cylinder leaves its platen."""
    return stress if test.mode == "shear" else np.maximum(stress, 0.0)


def ogden_roxburgh(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """1 - size erf((W_max - W) / (m W_top))."""
    energy = test.energy(test.strain)
    away = np.maximum.accumulate(energy) - energy
    return np.asarray(
        test.elastic(test.strain) * (1 - size * erf(away / (rng.uniform(0.1, 0.4) * energy.max())))
    )


def exponential_softening(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """1 - size (1 - exp(-(W_max - W)/w))."""
    energy = test.energy(test.strain)
    away = np.maximum.accumulate(energy) - energy
    lost = -np.expm1(-away / (rng.uniform(0.1, 0.3) * energy.max()))
    return np.asarray(test.elastic(test.strain) * (1 - size * lost))


def slack(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """A share of the reach in which nothing is borne."""
    del rng
    return test.elastic(np.maximum(test.strain - size * test.reach, 0.0))


def permanent_set(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """A share of the largest strain so far stays."""
    del rng
    strain = test.strain
    return test.elastic(np.maximum(strain - size * np.maximum.accumulate(strain), 0.0))


def soft_machine(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """A spring in line, as compliant as ``size`` of the specimen."""
    del rng
    own = np.linspace(0.0, test.reach, 5000)
    return np.asarray(
        np.interp(test.strain, own + size * test.elastic(own) / test.modulus, test.elastic(own))
    )


def creeping_slip(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """Of what goes beyond a strain a share slips for good."""
    strain, onset = test.strain, test.reach * rng.uniform(0.3, 0.6)
    slipped = size * np.maximum(np.maximum.accumulate(strain) - onset, 0.0)
    return test.elastic(np.maximum(strain - slipped, 0.0))


def sudden_slip(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """A piece of a share of the reach slips within 1 % of it."""
    strain, onset = test.strain, test.reach * rng.uniform(0.4, 0.8)
    gone = np.clip((np.maximum.accumulate(strain) - onset) / (0.01 * test.reach), 0.0, 1.0)
    return test.elastic(np.maximum(strain - size * test.reach * gone, 0.0))


def siebel_friction(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """A cylinder as high as it is wide, on platens with a coefficient, on the way up and, reversed, back."""
    del rng
    coming = np.gradient(test.strain) >= 0
    ratio = (1 - test.strain) ** -1.5
    return np.asarray(test.elastic(test.strain) * (1 + np.where(coming, 1, -1) * size * ratio / 3))


def drifting_cell(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """A load cell that drifts by a share of the largest stress, not steadily: no cause of the catalogue."""
    at = test.time / test.time[-1]
    drift = np.sin(2 * np.pi * (rng.uniform(1.0, 2.0) * at + rng.uniform())) + at
    elastic = test.elastic(test.strain)
    return np.asarray(elastic + size * elastic.max() * drift)


def rippling_screw(test: Protocol, size: float, rng: np.random.Generator) -> FloatArray:
    """A travel with the period of a bad screw: no cause of the catalogue."""
    strain = test.strain
    turns = rng.uniform(2.0, 4.0) * strain / test.reach
    return test.elastic(strain + size * test.reach * np.sin(2 * np.pi * turns))


@dataclass(frozen=True, slots=True)
class Known:
    """A cause as it is made: its name in the diagnosis, its sizes, small to large, and the mode that shows it."""

    label: str
    made: Made
    sizes: tuple[float, float, float]
    mode: BenchMode = "tension"


KNOWN: Mapping[str, Known] = MappingProxyType(
    {
        "nothing, tension": Known("none", clean, (0, 0, 0)),
        "nothing, compression": Known("none", clean, (0, 0, 0), "compression"),
        "nothing, shear": Known("none", clean, (0, 0, 0), "shear"),
        "stiffening (Fung)": Known("strain_stiffening", fung, (0.1, 0.3, 1.0)),
        "stiffening (Arruda-Boyce)": Known("strain_stiffening", arruda_boyce, (0.1, 0.3, 1.0)),
        "relaxation (Maxwell)": Known("viscoelasticity", maxwell, (0.1, 0.3, 0.8)),
        "relaxation (KWW), shear": Known("viscoelasticity", stretched_exponential, (0.15, 0.4, 1.0), "shear"),
        "softening (Ogden-Roxburgh)": Known("stress_softening", ogden_roxburgh, (0.08, 0.2, 0.45)),
        "softening (exponential)": Known("stress_softening", exponential_softening, (0.08, 0.2, 0.45)),
        "set": Known("permanent_set", permanent_set, (0.03, 0.07, 0.15)),
        "slack": Known("slack", slack, (0.04, 0.1, 0.25)),
        "soft machine": Known("machine_compliance", soft_machine, (0.1, 0.3, 0.8)),
        "slip, creeping": Known("clamp_slip", creeping_slip, (0.1, 0.25, 0.5)),
        "slip, sudden": Known("clamp_slip", sudden_slip, (0.04, 0.1, 0.2)),
        "friction (Siebel)": Known("platen_friction", siebel_friction, (0.08, 0.2, 0.4), "compression"),
        "a drifting load cell": Known("unknown", drifting_cell, (0.03, 0.08, 0.2)),
        "a rippling screw": Known("unknown", rippling_screw, (0.02, 0.05, 0.1)),
    }
)


def record(test: Protocol, stress: FloatArray, seed: int, name: str = "made") -> BenchTest:
    """Return a record of stresses (n,) with the noise of a test."""
    rng = np.random.default_rng(seed)
    noisy = stress + test.noise * float(np.abs(stress).max()) * rng.normal(size=len(stress))
    return BenchTest(name, test.mode, test.strain, noisy, test.time)


def drawn(known: Known, size: Size, rate: float, seed: int) -> BenchTest:
    """Return a record with a cause whose every particular a seed draws."""
    rng = np.random.default_rng(seed)
    test = Protocol(
        modulus=float(np.exp(rng.uniform(np.log(5e3), np.log(500e3)))),
        reach=float(rng.uniform(0.25, 0.45) if known.mode == "compression" else rng.uniform(0.3, 0.8)),
        cycles=int(rng.integers(2, 5)),
        rate=rate,
        noise=float(rng.uniform(0.002, 0.01)),
        mode=known.mode,
    )
    middle = known.sizes[SIZES.index(size)]
    amount = middle * _SCATTER_OF_SIZE ** float(rng.uniform(-1, 1))
    made = record(test, known.made(test, amount, rng), seed + 1)
    return replace(made, name=f"{known.label} {size} {rate:g}/s seed {seed}")
