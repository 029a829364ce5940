"""How large an effect is drawn: so that it stands out of the noise by as much as its level says.

The measure is the length of what the effect changes, in standard deviations of the noise over all rows (that of the
reported poses among it), less what a change of E and ν can imitate. Sizes are chosen on a coarse mesh, which costs
seconds. What is stiffer there by a few per cent may pass a threshold that the case as made never reaches: of a single
effect the measure is taken again there.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from estimator.blind.making.scenes.noise import correlation_of
from estimator.blind.making.scenes.retraction import Rows
from estimator.blind.making.scenes.scene import Drawn, Form, Mechanics, Readings, Scene
from estimator.blind.making.scenes.setup import Setup
from estimator.blind.making.scenes.simulate import PILOT, Carried, Resolution, carry_out, read
from estimator.blind.making.scenes.whitening import length, whitened, whitening_of
from estimator.errors import SolverError

FloatArray = NDArray[np.float64]
# Of each experiment (n, 6 + 3m): wrench, N and N m, and the beads' way from rest, m.
Channels = Sequence[FloatArray]

LEVELS: dict[str, tuple[float, float]] = {
    "large": (60.0, 400.0),
    "clear": (15.0, 60.0),
    "moderate": (6.0, 15.0),
    "subtle": (3.0, 6.0),
}
# Below the smallest level.
HIDDEN = "hidden"

_POISSON_STEP = 0.004
_POSITION_STEP_M = 1e-4
_TRIALS = 4


@dataclass(frozen=True, slots=True)
class Sized:
    """An effect of a chosen size, and by how many sigma it stands out of noise, E and ν."""

    drawn: Drawn
    size: float
    sigma: float

    @property
    def level(self) -> str:
        """The level that it has come out at."""
        return next((level for level, (low, _) in LEVELS.items() if self.sigma >= low), HIDDEN)


class Pilot:
    """Coarse runs of one setup, which tell how far an effect stands out."""

    def __init__(self, setup: Setup, resolution: Resolution = PILOT) -> None:
        self._setup = setup
        self._resolution = resolution
        self._base = self._run(Scene(setup.mechanics))
        law = setup.mechanics.law
        softer = replace(law, poisson_ratio=law.poisson_ratio - _POISSON_STEP)
        other = self._run(Scene(replace(setup.mechanics, law=softer)))
        scene = Scene(setup.mechanics)
        origin = self._channels(read(scene, self._base), scene)
        self._origins = {_refinement(setup.mechanics): origin}
        by_position = [self._by_position(axis, origin) for axis in range(3)]
        self._whitenings = [
            whitening_of(rows, np.stack(changes, axis=-1), setup.sensor, correlation_of(setup.noise))
            for rows, *changes in zip(setup.experiments, *by_position, strict=True)
        ]
        by_poisson = _difference(self._channels(read(scene, other), scene), origin)
        # Forces are in proportion to E, and places do not depend on it.
        by_modulus = [np.where(np.arange(channels.shape[1]) < 6, channels, 0.0) for channels in origin]
        imitable = [whitened(self._whitenings, change) for change in (by_poisson, by_modulus)]
        self._imitable, _ = np.linalg.qr(np.column_stack(imitable))

    def sigma(self, drawn: Drawn) -> float:
        """Return by how many standard deviations an effect stands out after E and ν are fitted.

        Raises
        ------
        SolverError
            It has no equilibrium: it is too large.
        """
        scene = drawn.change(Scene(self._setup.mechanics))
        same = scene.mechanics is self._setup.mechanics
        carried = self._base if same else self._run(scene)
        channels = self._channels(read(scene, carried), scene)
        if scene.rest_as_seen:
            return self._left(channels, self._with_beads_as_stated(scene, self._resolution))
        return self._left(channels, self._origin_on_mesh_of(scene.mechanics))

    def sigma_as_made(self, scene: Scene, carried: Carried, resolution: Resolution) -> float:
        """Return the same of a case that was carried out, beside one without effect on the same mesh.

        Parameters
        ----------
        scene : the mechanics with the effect, and the instruments
        carried : what came out of those mechanics
        resolution : at which they were carried out

        Raises
        ------
        SolverError
            The body without effect has no equilibrium.
        """
        mechanics = self._setup.mechanics
        if scene.rest_as_seen:
            channels = self._channels(read(scene, carried), scene)
            return self._left(channels, self._with_beads_as_stated(scene, resolution))
        plain = Scene(mechanics.meshed_like(scene.mechanics))
        without = (
            carried
            if scene.mechanics is mechanics
            else carry_out(plain.mechanics, self._setup.experiments, self._setup.beads, resolution)
        )
        return self._left(
            self._channels(read(scene, carried), scene), self._channels(read(plain, without), plain)
        )

    def _left(self, channels: Channels, others: Channels) -> float:
        """Return the length of what neither E nor ν can imitate of a difference."""
        return length(self._whitenings, _difference(channels, others), self._imitable)

    def _by_position(self, axis: int, origin: Channels) -> Channels:
        """Return how all rows but the first, at rest, change with the gripper's position along an axis, per m."""

        def aside(rows: Rows) -> Rows:
            shift = np.zeros_like(rows.position)
            shift[1:, axis] = _POSITION_STEP_M
            return rows.moved(rows.position + shift)

        scene = Scene(replace(self._setup.mechanics, motion=(*self._setup.mechanics.motion, aside)))
        changed = self._channels(read(scene, self._run(scene)), scene)
        return [change / _POSITION_STEP_M for change in _difference(changed, origin)]

    def _origin_on_mesh_of(self, mechanics: Mechanics) -> Channels:
        """Return what the body without an effect shows, solved with the errors of this one's mesh."""
        refinement = _refinement(mechanics)
        if refinement not in self._origins:
            scene = Scene(self._setup.mechanics.meshed_like(mechanics))
            self._origins[refinement] = self._channels(read(scene, self._run(scene)), scene)
        return self._origins[refinement]

    def _with_beads_as_stated(self, scene: Scene, resolution: Resolution) -> Channels:
        """Return what the body without an effect shows of beads that sit where a scene's rest positions say."""
        places = reduce(lambda beads, seen: seen(beads), scene.rest_as_seen, self._setup.beads)
        plain = self._setup.mechanics.meshed_like(scene.mechanics)
        carried = carry_out(plain, self._setup.experiments, places, resolution)
        return [
            np.hstack([reading.wrench, (reading.beads - places).reshape(len(reading.wrench), -1)])
            for reading in carried.readings
        ]

    def _run(self, scene: Scene) -> Carried:
        return carry_out(scene.mechanics, self._setup.experiments, self._setup.beads, self._resolution)

    def _channels(self, readings: Sequence[Readings], scene: Scene) -> Channels:
        rest = stated_rest(self._setup, scene, readings)
        return [
            np.hstack([reading.wrench, (reading.beads - rest).reshape(len(reading.wrench), -1)])
            for reading in readings
        ]


def _difference(channels: Channels, others: Channels) -> Channels:
    return [one - other for one, other in zip(channels, others, strict=True)]


def _refinement(mechanics: Mechanics) -> tuple[object, ...]:
    return mechanics.breaks, mechanics.has_region


def stated_rest(setup: Setup, scene: Scene, readings: Sequence[Readings]) -> FloatArray:
    """Return the rest positions that the operator writes down, (m, 3) m."""
    rest = readings[0].beads[0] if scene.rest_after_mounting else setup.beads
    return np.round(reduce(lambda places, seen: seen(places), scene.rest_as_seen, rest), 7)


def sized(pilot: Pilot, draw: Callable[[float], Drawn], form: Form, target: float) -> Sized:
    """Choose the size of an effect so that it stands out by about ``target`` sigma, within the form's range."""
    low, high = form.range
    size = float(np.clip(1.0, low, high))
    best: Sized | None = None
    ceiling = high
    for _ in range(_TRIALS):
        drawn = draw(size)
        try:
            sigma = pilot.sigma(drawn)
        except SolverError:
            ceiling = size
            size = max(low, size / 2)
            continue
        found = Sized(drawn, size, sigma)
        if best is None or _distance(sigma, target) < _distance(best.sigma, target):
            best = found
        factor = float(np.clip(target / max(sigma, 1e-3), 0.05, 20.0))
        following = float(np.clip(size * factor, low, 0.9 * ceiling if ceiling < high else high))
        if abs(np.log(factor)) < 0.12 or np.isclose(following, size):
            break
        size = following
    if best is None:
        raise SolverError(f"form {form.name}: no size has an equilibrium; draw another case")
    return best


def _distance(sigma: float, target: float) -> float:
    return abs(float(np.log(max(sigma, 1e-6) / target)))
