"""The paper's estimator on its low-density mesh, tabulated once, so that an estimate costs next to nothing.

Positions under a prescribed motion depend on ν alone, and forces are proportional to E: x(ν) and E f(ν). The objective
of eq. (1),

    J(E, ν) = Σ ‖x(ν) − x_o‖² + C Σ ‖E f(ν) − f_o‖²,

is therefore least in E at Ê(ν) = Σ f·f_o / Σ f·f for every ν, and what is left is a search along ν alone. Its minimum
is that of the paper's sequential quadratic programming where that has converged. The scale factor of eq. (3) is

    C = (max − min of Σ ‖x − x_o‖²) / (max − min of Σ ‖f − f_o‖²)

over the region of interest, each minimum by a minimisation of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimator.studies.paper_tables.response import RATIOS, UnitResponse, solve_response
from estimator.studies.paper_tables.tetrahedra import block_of_tetrahedra
from estimator.studies.published_gap.retractions import Anchoring, MotionName, SetUp, retraction
from estimator.studies.running.arrays import as_text, from_text
from estimator.studies.running.case import Parametric, Row

FloatArray = NDArray[np.float64]

# Between the least and the largest ν that are solved.
_SEARCHED = 800
_UNIT_PA = 1e4
LOW_DENSITY_CELLS = (17, 17, 2)


@dataclass(frozen=True)
class Readings:
    """What a retraction moved and pulled since its first row: (..., r) shares of beads' way, m, and of force, N.

    Attributes
    ----------
    moved : (..., r, m, 3), m
    force : (..., r, 3), N
    """

    moved: FloatArray
    force: FloatArray

    def __add__(self, other: "Readings") -> "Readings":
        return Readings(self.moved + other.moved, self.force + other.force)

    def __sub__(self, other: "Readings") -> "Readings":
        return Readings(self.moved - other.moved, self.force - other.force)

    def times(self, factor: FloatArray | float) -> "Readings":
        """Return it with everything multiplied; the factor's axes are the leading ones."""
        by = np.asarray(factor)
        return Readings(self.moved * by[..., None, None, None], self.force * by[..., None, None])


@dataclass(frozen=True)
class LowDensityResponse(Parametric):
    """The low density's answer to one retraction for all ν of the table."""

    set_up: SetUp
    anchoring: Anchoring
    motion: MotionName
    cells: tuple[int, int, int] = LOW_DENSITY_CELLS

    @property
    def name(self) -> str:
        """Which retraction."""
        return (
            f"the low density's {self.motion.replace('_', ' ')}, {self.anchoring.replace('_', ' ')} anchored"
        )

    def run(self) -> Row:
        """Solve it; forces are those of 10 kPa."""
        planned = retraction(self.set_up, self.anchoring, self.motion)
        found = solve_response(block_of_tetrahedra(planned, self.cells), planned)
        return {"moved": as_text(found.moved), "force": as_text(_UNIT_PA * found.force)}

    def table(self, row: Row) -> "ResponseTable":
        """Return what :meth:`run` found as a table."""
        steps = self.set_up.steps
        moved = from_text(str(row["moved"]), (len(RATIOS), steps, -1, 3))
        force = from_text(str(row["force"]), (len(RATIOS), steps, 3)) / _UNIT_PA
        return ResponseTable(UnitResponse(np.array(RATIOS), moved, force))


@dataclass(frozen=True)
class Region:
    """The region of interest of eq. (3): E up to so many times the best, and ν from zero."""

    modulus_share: tuple[float, float] = (0.1, 2.0)
    poisson_ratio: tuple[float, float] = (0.0, 0.4995)


DEFAULT_REGION = Region()


@dataclass(frozen=True, eq=False)
class ResponseTable:
    """A model's answer to one retraction, and that answer at many ν.

    Attributes
    ----------
    response : UnitResponse
    """

    response: UnitResponse

    def __getstate__(self) -> dict[str, object]:
        """Leave out what is interpolated: it is made anew in less time than it takes to send."""
        solved = self.response
        return {"response": UnitResponse(solved.ratios, solved.moved, solved.force)}

    @cached_property
    def poisson_ratio(self) -> FloatArray:
        """Many ν (k,), ascending."""
        first, last = (float(x) for x in -np.log1p(-2 * self.response.ratios[[0, -1]]))
        return np.asarray(-np.expm1(-np.linspace(first, last, _SEARCHED)) / 2)

    @cached_property
    def moved(self) -> FloatArray:
        """How the beads move at each of them, (k, r·m·3), m."""
        return self.response.at(self.poisson_ratio)[0]

    @cached_property
    def force(self) -> FloatArray:
        """The forces there, (k, r·3), N/Pa."""
        return self.response.at(self.poisson_ratio)[1]

    def estimate(self, seen: Readings, region: Region | None = None) -> tuple[FloatArray, FloatArray]:
        """Return E (Pa) and ν that the paper's objective finds, each (n,).

        Parameters
        ----------
        seen : (n, r, m, 3) and (n, r, 3)
        region : of the scale factor; None lets all displacements weigh as much as all forces
        """
        moved, force = seen.moved.reshape(len(seen.moved), -1), seen.force.reshape(len(seen.force), -1)
        in_moved = _squares(moved, self.moved)
        along = force @ self.force.T
        square = np.sum(self.force**2, axis=1)
        modulus = along / square
        in_force = np.sum(force**2, axis=1)[:, None] - along * modulus
        scale = self._scale(moved, force, in_moved, in_force, modulus, region)
        left = in_moved + scale[:, None] * in_force
        left[:, self.poisson_ratio < (region or DEFAULT_REGION).poisson_ratio[0]] = np.inf
        best = np.argmin(left, axis=1)
        ratio = _lowest(self.poisson_ratio, left, best)
        rows = np.arange(len(best))
        between = np.array([np.interp(r, self.poisson_ratio, m) for r, m in zip(ratio, modulus, strict=True)])
        return np.where(np.isfinite(between), between, modulus[rows, best]), ratio

    def _scale(
        self,
        moved: FloatArray,
        force: FloatArray,
        in_moved: FloatArray,
        in_force: FloatArray,
        modulus: FloatArray,
        region: Region | None,
    ) -> FloatArray:
        """Return the factor of eq. (3), (n,), m²/N²."""
        if region is None:
            return np.asarray(np.sum(moved**2, axis=1) / np.sum(force**2, axis=1))
        inside = (self.poisson_ratio >= region.poisson_ratio[0]) & (
            self.poisson_ratio <= region.poisson_ratio[1]
        )
        best = modulus[np.arange(len(modulus)), np.argmin(in_force, axis=1)]
        square = np.sum(self.force[inside] ** 2, axis=1)
        along = force @ self.force[inside].T
        worst = np.max(
            [
                np.max((s * best[:, None]) ** 2 * square - 2 * s * best[:, None] * along, axis=1)
                for s in region.modulus_share
            ],
            axis=0,
        ) + np.sum(force**2, axis=1)
        spread = np.max(in_moved[:, inside], axis=1) - np.min(in_moved[:, inside], axis=1)
        return np.asarray(spread / (worst - np.min(in_force[:, inside], axis=1)))


def _squares(one: FloatArray, others: FloatArray) -> FloatArray:
    """Return squared distances (n, k) of rows (n, c) and (k, c)."""
    return np.asarray(
        np.sum(one**2, axis=1)[:, None] - 2 * one @ others.T + np.sum(others**2, axis=1)[None, :]
    )


def _lowest(places: FloatArray, values: FloatArray, best: NDArray[np.int64]) -> FloatArray:
    """Return where parabolas through the least of values (n, k) and its neighbours are least, (n,)."""
    inner = np.clip(best, 1, len(places) - 2)
    rows = np.arange(len(best))
    x = np.stack([places[inner + shift] for shift in (-1, 0, 1)])
    y = np.stack([values[rows, inner + shift] for shift in (-1, 0, 1)])
    with np.errstate(invalid="ignore", divide="ignore"):
        first, last = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
        bend = (last - first) / (x[2] - x[0])
        found = (x[0] + x[1]) / 2 - first / (2 * bend)
    usable = np.isfinite(found) & (bend > 0) & (best == inner)
    return np.where(usable, np.clip(found, x[0], x[2]), places[best])


def estimates(
    tables: Sequence[ResponseTable], seen: Sequence[Readings], region: Region | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return E (Pa) and ν, (n, c), of readings of each of the conditions with their tables."""
    found = [table.estimate(one, region) for table, one in zip(tables, seen, strict=True)]
    return np.stack([e for e, _ in found], axis=1), np.stack([r for _, r in found], axis=1)
