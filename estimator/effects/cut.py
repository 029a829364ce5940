"""The tissue is cut, or has torn, at some place: no label of the catalogue."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimator.effects.effect import OUTSIDE, Amplitude, Constant, Effect, Readings, Values
from estimator.effects.places import CENTRE, belonging, places_of
from estimator.experiment import Experiment
from estimator.fem.problem import RetractionProblem
from estimator.fem.quadrature import quadrature_points
from estimator.fem.terms import Term
from estimator.fem.weak_planes import WeakPlanes
from estimator.materials.material import Material

FloatArray = NDArray[np.float64]

# All of what the tissue bears across the cut at the upper bound.
_WEAKNESS = Amplitude("weakness", "1", scale=0.3, smallest=0.03, lower=0.0, upper=0.95)
_RADIUS = Constant("radius", "m", (0.006,), lower=0.004, upper=0.04)
_NORMAL = Constant("normal", "rad", (0.0, float(np.pi / 2)), lower=-np.pi / 2, upper=np.pi)


class Cut(Effect):
    """A cut through the thickness, smeared over a cylinder about it: across it the tissue is weak, along it whole.

    From afar a cut of length 2a is told by how much compliance it adds, which goes by a², alone: one in a cylinder of
    radius R takes a share of about 2 (a/R)² from Young's modulus across it (parallel cracks in a plane, M. Kachanov,
    Appl. Mech. Rev. 45 (1992) 304). What it adds to the compliance in shear is the same in the plane, and by 1 + ν more
    out of it (H. Tada, The Stress Analysis of Cracks Handbook, 1973): as G is smaller than E, of the shear moduli it
    takes less. The normal lies in the plane, at ``normal`` from the x axis towards y.
    """

    label = OUTSIDE
    group = "inhomogeneity"
    words = "The tissue is cut or torn at a place."
    form = "cut"
    mistaken_for = ("inhomogeneity", "fiducial_misread")
    amplitudes = (_WEAKNESS,)
    constants = (*CENTRE, _RADIUS, _NORMAL)

    def __init__(self, region: Values | None = None) -> None:
        """Look for a cut everywhere, or within a region: its centre and radius."""
        self._region = region

    def starts(self, baseline: Sequence[Readings]) -> list[dict[str, float]]:
        """Return the grid, spread over the phantom's edges, without the places inside the grasp; or the region."""
        if self._region is not None:
            return [{**self._region, _NORMAL.name: normal} for normal in _NORMAL.grid]
        return places_of(baseline[0].experiment, super().starts(baseline))

    def looked_for_at(self, centre: FloatArray, radius_m: float) -> Effect:
        """Return the cut as it is looked for within what it is mistaken for."""
        return Cut({CENTRE[0].name: centre[0], CENTRE[1].name: centre[1], _RADIUS.name: radius_m})

    def place(self, problem: RetractionProblem, values: Values) -> tuple[FloatArray, float] | None:
        """Return the cut's middle and the radius of the cylinder about it."""
        return np.array([values["centre_x"], values["centre_y"], 0.0]), values[_RADIUS.name]

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Return what the cut takes from the stress."""
        if not values[_WEAKNESS.name]:
            return ()
        arms = quadrature_points(problem.body.mesh)[..., :2] - [values["centre_x"], values["centre_y"]]
        depth = values[_RADIUS.name] - np.linalg.norm(arms, axis=-1)
        weakness = values[_WEAKNESS.name] * belonging(depth, np.cbrt(problem.body.volume))
        modulus = material.youngs_modulus
        modulus_over_shear = 2 * (1 + material.poisson_ratio)
        shear = modulus / modulus_over_shear
        in_plane, out_of_plane = (_lost_in_shear(weakness, one) for one in (modulus_over_shear, 2.0))
        lost = np.stack([modulus / 4 * weakness, shear * in_plane, shear * out_of_plane])
        cos, sin = np.cos(values[_NORMAL.name]), np.sin(values[_NORMAL.name])
        axes = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
        return (WeakPlanes(problem.body, axes, lost),)


def _lost_in_shear(weakness: FloatArray, times_less: float) -> FloatArray:
    """Return the share (e, q) lost of a shear modulus where Young's modulus across the cut loses ``weakness``.

    1 / E grows by a share of w / (1 − w), and 1 / G by ``times_less`` as small a one.
    """
    return weakness / (weakness + times_less * (1.0 - weakness))
