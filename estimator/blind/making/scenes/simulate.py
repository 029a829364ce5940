"""Carries a scene out: the three retractions in their order, on one body that remembers."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.blind.making.mechanics.body import Body
from estimator.blind.making.mechanics.brick_mesh import NEAREST_TO_A_FACE, Break, BrickMesh, brick_mesh
from estimator.blind.making.mechanics.equilibrium import Solver, State, along
from estimator.blind.making.mechanics.holding import HeldBody, Pose
from estimator.blind.making.mechanics.response import Instant, Material
from estimator.blind.making.mechanics.surfaces import LoadedFace
from estimator.blind.making.scenes.retraction import GRIPPER_AT_REST, Rows
from estimator.blind.making.scenes.scene import GRASP_X, GRASP_Y, SIZE, Mechanics, Readings, Scene

FloatArray = NDArray[np.float64]

_TOUCH = 1e-7
# A grasp turned about z drags the mesh around it along, less and less over this distance, m.
_YAW_REACH = 0.02


@dataclass(frozen=True, slots=True)
class Resolution:
    """Edge lengths of the mesh, m: at the grasp, at the anchor, anywhere, and where a region differs from the rest.

    ``growth`` is by which edges lengthen with the distance from those, m per m; ``layers`` counts cells through the
    thickness. A single layer of these elements would bend without resistance.
    """

    grasp: float
    anchor: float
    largest: float
    region: float
    growth: float = 1.0
    layers: int = 2


FINE = Resolution(0.0005, 0.0015, 0.008, 0.005)
PILOT = Resolution(0.005, 0.012, 0.018, 0.010)
TRIAL = Resolution(0.010, 0.025, 0.025, 0.020)


@dataclass(frozen=True, slots=True)
class Carried:
    """What came out.

    Attributes
    ----------
    readings : one an experiment, in the order they were done, free of noise
    unknowns, iterations : size of the mesh, and Newton's steps
    """

    readings: tuple[Readings, ...]
    unknowns: int
    iterations: int


def carry_out(
    mechanics: Mechanics,
    experiments: Sequence[Rows],
    beads: FloatArray,
    resolution: Resolution,
    tell: Callable[[int, int], None] = lambda done, total: None,
) -> Carried:
    """Deform the body along all experiments, and read true instruments.

    ``beads`` (m, 3) are stated rest positions on a block of stated size; readings are relative to them. ``tell``
    hears how many of how many rows are done.
    """
    body = CarriedBody(mechanics, beads, resolution)
    total, done, readings = sum(len(rows.time) for rows in experiments), 0, []
    for rows in experiments:
        readings.append(body.along(rows, partial(_tell_beyond, tell, done, total)))
        done += len(rows.time)
    return Carried(tuple(readings), body.solver.unknowns, body.solver.iterations)


def _tell_beyond(tell: Callable[[int, int], None], before: int, total: int, done: int, _: int) -> None:
    tell(before + done, total)


class CarriedBody:
    """One body that is led along one experiment after another, and remembers; ``solver`` counts its steps."""

    def __init__(self, mechanics: Mechanics, beads: FloatArray, resolution: Resolution) -> None:
        self.solver = Solver(held_body(mechanics, resolution))
        mesh = self.solver.held.body.mesh
        cells, self._shapes = mesh.locate(_on_top(mechanics, beads))
        self._nodes = mesh.cells[cells]
        self._motion = mechanics.motion
        self._beads = beads
        self._last = self.solver.rest()

    def along(self, rows: Rows, tell: Callable[[int, int], None] = lambda done, total: None) -> Readings:
        """Return what true instruments read along one experiment more."""
        true = rows
        for change in self._motion:
            true = change(true)
        wrench, positions = [], []
        states = _states(self.solver, self.solver.after_rest(self._last), true)
        for row, state in enumerate(states, start=1):
            wrench.append(state.wrench)
            positions.append(self._beads + np.einsum("mn,mni->mi", self._shapes, state.u[self._nodes]))
            tell(row, len(rows.time))
            self._last = state
        # The reported orientation carries the sensor's frame: nobody knows the true one.
        reading = Readings(rows, np.array(wrench), np.array(positions))
        sensed = reading.sensed()
        return reading.with_sensed(sensed - sensed[0])


def _on_top(mechanics: Mechanics, beads: FloatArray) -> FloatArray:
    """Return where beads (m, 3) sit on the upper face of the true body, m."""
    x, y = beads[:, :2].T
    top = mechanics.outline.top(x, y) if mechanics.outline else np.full(len(beads), mechanics.thickness / 2)
    return np.column_stack([x, y, top])


def read(scene: Scene, carried: Carried) -> tuple[Readings, ...]:
    """Read a carried-out scene by its own instruments."""
    return tuple(
        reduce(lambda reading, distort: distort(reading), scene.readings, reading)
        for reading in carried.readings
    )


def held_body(mechanics: Mechanics, resolution: Resolution) -> HeldBody:
    """Mesh the body of a scene and hold it as the scene says."""
    mesh = _mesh(mechanics, resolution)
    body = Body(mesh)
    x, y, _ = mesh.grid.T
    shift_x, shift_y = mechanics.grasp_shift
    grasp_x, grasp_y = mechanics.grasp_x, mechanics.grasp_y
    end = grasp_x[1] + shift_x
    # The mesh has no plane so close to its face, which then is the end of the grasp.
    end = SIZE[0] / 2 if abs(end - SIZE[0] / 2) < NEAREST_TO_A_FACE else end
    gripped = (x > grasp_x[0] + shift_x - _TOUCH) & (x < end + _TOUCH)
    gripped &= (y > grasp_y[0] + shift_y - _TOUCH) & (y < grasp_y[1] + shift_y + _TOUCH)
    points = body.gauss_points
    stiffness = np.ones(len(points))
    for factor in mechanics.stiffness:
        stiffness = stiffness * factor(points)
    tear = mechanics.tear
    material = Material(
        mechanics.law,
        stiffness,
        mechanics.relaxation,
        mechanics.softening,
        mechanics.permanent_set,
        None if tear is None else lambda instant: tear(points, instant),
        mechanics.seasons,
        mechanics.swelling,
        mechanics.mended,
    )
    centre = GRIPPER_AT_REST + np.array([*mechanics.centre_shift, 0.0])
    return HeldBody(
        body,
        material,
        np.zeros(len(x), dtype=bool) if mechanics.anchor else _anchored(mechanics, mesh),
        gripped,
        Pose(centre, Rotation.identity()),
        np.array(mechanics.body_force),
        tuple(_loaded_faces(mechanics, mesh)),
        mechanics.grip,
        None if mechanics.heavy is None else mechanics.heavy(points),
    )


def _states(solver: Solver, state: State, rows: Rows) -> Iterator[State]:
    """Follow the rows of one experiment."""
    poses = [Pose(p, r) for p, r in zip(rows.position, rows.rotation, strict=True)]
    travel = rows.travel

    def instant(row: int, part: float = 1.0) -> Instant:
        interval = rows.time[row] - rows.time[row - 1] if row else 0.0
        way = travel[row - 1] + part * (travel[row] - travel[row - 1]) if row else 0.0
        return Instant(rows.time[row] - (1 - part) * interval, part * interval, rows.order, way)

    state = solver.advance(state, poses[0], instant(0))
    yield state
    visited = {_key(poses[0]): state.u}
    path = [(0.0, state.u)]
    for row in range(1, len(poses)):
        pose, now = poses[row], instant(row)
        moves = abs(travel[row] - travel[row - 1]) > 1e-9
        if rows.phase[row] == "return" and rows.phase[row - 1] == "hold":
            path = path[-1:]
        if moves and solver.held.material.remembers:
            state = solver.advance(state, poses[row - 1].towards(pose, 0.5), instant(row, 0.5))
            now = replace(now, interval=0.5 * now.interval)
        guess = visited.get(_key(pose))
        if guess is None:
            guess = along(path, travel[row]) if moves else state.u
        state = solver.advance(state, pose, now, guess=guess)
        visited[_key(pose)] = state.u
        if moves:
            path = [*path[-2:], (travel[row], state.u)]
        yield state


def _key(pose: Pose) -> tuple[float, ...]:
    return tuple(np.round(np.concatenate([pose.position, pose.rotation.as_rotvec()]), 9))


def _mesh(mechanics: Mechanics, resolution: Resolution) -> BrickMesh:
    shift_x, shift_y = mechanics.grasp_shift
    half_x, half_y = SIZE[0] / 2, SIZE[1] / 2
    grasp_x = [Break(at + shift_x, resolution.grasp) for at in mechanics.grasp_x]
    # Jaws that hold the whole width have no edges within it.
    grasp_y = [Break(at + shift_y, resolution.grasp) for at in mechanics.grasp_y if abs(at) < half_y]
    # The ends of the anchored face are sharper than its middle; a second anchored face is sharp all along.
    beside = resolution.anchor if mechanics.two_sides else 2 * resolution.anchor
    x = [Break(-half_x, resolution.anchor), *grasp_x, *mechanics.breaks[0]]
    y = [Break(-half_y, 2 * resolution.anchor), *grasp_y, Break(half_y, beside), *mechanics.breaks[1]]
    floor = min(resolution.grasp, SIZE[2])
    around = [
        [b for part in mechanics.parts for b in part.breaks(axis, resolution.region / 2)] for axis in range(3)
    ]
    finest = [
        [Break(b.at, max(b.edge, floor)) for b in (*own, *parts)]
        for own, parts in zip((x, y), around[:2], strict=True)
    ]
    mesh = brick_mesh(
        (SIZE[0], SIZE[1], mechanics.thickness),
        (finest[0], finest[1], around[2]),
        resolution.region if mechanics.has_region else resolution.largest,
        resolution.growth,
        resolution.layers * (mechanics.outline.layers if mechanics.outline else 1),
        _reshape(mechanics),
    )
    cavities = [part for part in mechanics.parts if part.kind == "cavity"]
    if not cavities:
        return mesh
    middles = mesh.grid[mesh.cells].mean(axis=1)
    return mesh.without(np.any([part.holds(middles) for part in cavities], axis=0))


def _reshape(mechanics: Mechanics) -> Callable[[FloatArray], FloatArray] | None:
    """Return what moves the block's nodes to where they lie at rest; None where they lie there."""
    if mechanics.outline is not None:
        return mechanics.outline.shaped
    return None if mechanics.grasp_yaw == 0 else lambda grid: _turned(grid, mechanics)


def _turned(grid: FloatArray, mechanics: Mechanics) -> FloatArray:
    """Turn the grasped region about z; the block's own faces stay where they are.

    What a face keeps from turning with the rest slides along it, so that it stays between the turned sides.
    """
    centre = np.array([np.mean(GRASP_X), np.mean(GRASP_Y)]) + mechanics.grasp_shift
    x, y = (grid[:, :2] - centre).T
    beyond_x = np.maximum(np.abs(x) - 0.01, 0.0)
    beyond_y = np.maximum(np.abs(y) - 0.01, 0.0)
    fade = np.clip(1 - np.maximum(beyond_x, beyond_y) / _YAW_REACH, 0.0, 1.0)
    room = np.clip((SIZE[0] / 2 - grid[:, 0]) / 0.02, 0.0, 1.0)
    cosine, sine = np.cos(mechanics.grasp_yaw), np.sin(mechanics.grasp_yaw)
    to_x = x + room * ((cosine - 1.0) * x - sine * y)
    to_y = (y + sine * to_x) / cosine
    points = grid.copy()
    points[:, 0] += fade * (to_x - x)
    points[:, 1] += fade * (to_y - y)
    return points


def _anchored(mechanics: Mechanics, mesh: BrickMesh) -> NDArray[np.bool_]:
    on_face = mesh.grid[:, 0] < -SIZE[0] / 2 + _TOUCH
    if mechanics.two_sides:
        on_face |= mesh.grid[:, 1] > SIZE[1] / 2 - _TOUCH
    if mechanics.bonded is not None:
        on_face &= mechanics.bonded(mesh.points)
    return on_face


def _loaded_faces(mechanics: Mechanics, mesh: BrickMesh) -> Iterator[LoadedFace]:
    if mechanics.anchor is not None:
        yield LoadedFace(mesh.face("x", -1), mechanics.anchor(0))
        if mechanics.two_sides:
            yield LoadedFace(mesh.face("y", +1), mechanics.anchor(1))
    if mechanics.table is not None:
        yield LoadedFace(mesh.face("z", -1), mechanics.table)
