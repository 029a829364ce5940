"""A source and its mapping as an experiment."""

from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.errors import InputError
from estimator.experiment.holds import Grasp, Roller
from estimator.experiment.model import Environment, Experiment, SurfaceBelow, TrajectoryKind
from estimator.experiment.observations import WRENCH_COLUMNS
from estimator.importing.bodies import body_of, box_of, centre_of
from estimator.importing.clocks import at, times_of
from estimator.importing.course import kept_rows, phases_of, rows_at_rest, steps_of, zero_at_rest
from estimator.importing.frames import SourceFrame
from estimator.importing.mapping import POSITIONS, QUATERNION, TURNS, ImportMapping
from estimator.importing.poses import (
    along_tissue_axes,
    pose_of_points,
    quaternions_between,
    relative_turns,
    turns_of_angles,
)
from estimator.importing.table import FloatArray, Source, Table
from estimator.importing.units import Quantity, factor_of


def experiment_of(source: Source, mapping: ImportMapping, scratch: Path) -> Experiment:
    """Return what a source holds, by its mapping, in SI units in the tissue frame.

    Motion and forces are counted from the first row that is used, where the gripper is at its stated centre.

    Parameters
    ----------
    scratch : folder for the surface of a cylinder

    Raises
    ------
    InputError
        A column is missing, a unit is unknown, or the mapping contradicts the source.
    """
    reading = _Reading(source, mapping)
    frame = SourceFrame(mapping.R_tissue_source, np.array(mapping.origin))
    body = body_of(mapping, scratch)
    grasp_box = box_of(mapping.grasp, body.bounds)
    centre = mapping.centre or centre_of(mapping.grasp, grasp_box, body.bounds)
    places, turns, lost = reading.gripper()
    moved = frame.vectors(places - places[0])
    turned = along_tissue_axes(relative_turns(turns), mapping.R_tissue_source)
    if mapping.gripper_points:
        # the middle of the points moves with the gripper's origin and turns about it
        arm = np.array(centre) - frame.points(places[0])
        moved = moved + turned.apply(arm) - arm
    beads, rest = reading.beads(frame)
    wrench = reading.wrench(frame, turns)
    distance = np.linalg.norm(np.nan_to_num(moved), axis=1) + np.nan_to_num(turned.magnitude()) * 1e-3
    keep = kept_rows(distance, 0, len(distance) - 1, mapping.rows[2])
    keep = keep[~lost[keep]]
    if len(keep) < 2:
        raise InputError(
            f"{mapping.file}: [rows] leaves {len(keep)} rows in which the gripper is seen; take more"
        )
    time = reading.time[keep]
    position = np.array(centre) + moved[keep]
    readings = wrench[keep]
    if mapping.zeroed:
        readings = readings - zero_at_rest(wrench, rows_at_rest([distance]), mapping.rows[0], mapping.file)
    return Experiment(
        name=mapping.name,
        phantom_id=mapping.phantom_id,
        order=mapping.order,
        phantom=body.phantom,
        anchors=tuple(box_of(anchor, body.bounds) for anchor in mapping.anchors),
        rollers=tuple(Roller(box_of(box, body.bounds), along) for box, along in mapping.rollers),
        grasp=Grasp(grasp_box, centre, mapping.grasp_directions),
        trajectory_kind=cast(TrajectoryKind, mapping.kind),
        environment=Environment(mapping.gravity, cast(SurfaceBelow, mapping.surface_below)),
        sensor=mapping.noise,
        fiducials_rest=rest,
        time=time - time[0],
        phase=phases_of(distance[keep]),
        step=steps_of(distance[keep]),
        position=position,
        quaternion_wxyz=turned[keep].as_quat(scalar_first=True, canonical=True),
        wrench=readings,
        fiducials=beads[keep],
    )


BoolArray = NDArray[np.bool_]
_LEAST_LENGTH = 0.5  # of a quaternion; a shorter one is none


def _turned(turns: Rotation, vectors: FloatArray) -> FloatArray:
    """Return vectors (n, 3) along the axes that the turns are stated in; NaN where a component is not known."""
    known = np.isfinite(vectors).all(axis=1, keepdims=True)
    return np.where(known, turns.apply(np.where(known, vectors, 0.0)), np.nan)


class _Reading:
    """Columns of a source at the rows of one of its tables: that of the beads, else that of the motion."""

    def __init__(self, source: Source, mapping: ImportMapping) -> None:
        self._source, self._mapping = source, mapping
        self._base = self._base_table()
        self._times = times_of(source, mapping.clocks, mapping.file)
        first, last, _ = mapping.rows
        count = self._base.rows
        end = count if last is None else last
        if not 1 <= first < end <= count:
            raise InputError(
                f"{mapping.file}: [rows] first to last is {first} to {end}, and there are {count} rows"
            )
        self._rows = slice(first - 1, end)
        if self._base.name not in self._times:
            raise InputError(
                f"{mapping.file}: the table {self._base.name!r} has no [[clock]]; add one, with its time or its rate"
            )
        self.time = self._times[self._base.name][self._rows]

    def gripper(self) -> tuple[FloatArray, Rotation, BoolArray]:
        """Return places (n, 3), m, and turns of the gripper in the source's axes, and in which rows there is none."""
        mapping = self._mapping
        if mapping.gripper_points:
            where = f"{mapping.file}: [gripper] columns"
            return pose_of_points(self._points(mapping.gripper_points, mapping.gripper_unit, where), where)
        places = np.stack([self._channel(name, "length", 0.0) for name in POSITIONS], axis=1)
        if mapping.machine_axis is not None:
            places = places + self._channel("p", "length", 0.0)[:, None] * mapping.machine_axis
        if not any(name in mapping.channels for name in (*POSITIONS, "p")):
            raise InputError(
                f"{mapping.file}: neither [columns] px, py, pz nor [gripper] columns tells how the gripper moves; "
                "add one"
            )
        turns, unknown = self._turns()
        lost = np.asarray(~np.isfinite(places).all(axis=1) | unknown)
        if lost[0]:
            raise InputError(
                f"{mapping.file}: [rows] first: place or orientation of the gripper is not known in the first row; "
                "begin at another row"
            )
        return places, turns, lost

    def _turns(self) -> tuple[Rotation, BoolArray]:
        """Return the gripper's turns in the source's axes, and in which rows they are named and not known."""
        named = self._mapping.channels
        nothing = Rotation.identity(len(self.time)), np.zeros(len(self.time), dtype=bool)
        names = QUATERNION if all(name in named for name in QUATERNION) else TURNS
        given = [name for name in names if name in named]
        if not given:
            return nothing
        where = f"{self._mapping.file}: [columns] {given[0]}"
        table, _ = self._source.find(named[given[0]].column, where)
        quantity: Quantity | None = None if names is QUATERNION else "angle"
        own = np.stack([self._of_table(table, name, quantity) for name in names], axis=1)
        if names is TURNS:
            known = np.isfinite(own).all(axis=1, keepdims=True)
            turns = turns_of_angles(np.where(known, own, 0.0), self._mapping.turn_form).as_quat(
                scalar_first=True
            )
            own = np.where(known, turns, np.nan)
        length = np.linalg.norm(own, axis=1, keepdims=True)
        own = np.where(length > _LEAST_LENGTH, own, np.nan)
        if not np.isfinite(own).any():
            return nothing  # a quaternion that nobody has set
        if table.name != self._base.name and table.name in self._times:
            own = quaternions_between(self._times[table.name], own, self._all_times())
        rows = own[self._rows]
        unknown = np.asarray(~np.isfinite(rows).all(axis=1))
        return Rotation.from_quat(
            np.where(unknown[:, None], [1.0, 0, 0, 0], rows), scalar_first=True
        ), unknown

    def _of_table(self, table: Table, name: str, quantity: Quantity | None) -> FloatArray:
        """Return a channel of an orientation in the rows of its table, 0 where it is not named.

        Raises
        ------
        InputError
            It stands in another table than the others.
        """
        channel = self._mapping.channels.get(name)
        if channel is None:
            return np.zeros(table.rows)
        where = f"{self._mapping.file}: [columns] {name}"
        owner, column = self._source.find(channel.column, where)
        if owner.name != table.name:
            raise InputError(
                f"{where}: is of the table {owner.name!r}, and others of the orientation of {table.name!r}; "
                "name columns of one table"
            )
        factor = 1.0 if quantity is None else factor_of(channel.unit, quantity, where)
        return np.asarray(channel.sign * factor * column.values)

    def wrench(self, frame: SourceFrame, turns: Rotation) -> FloatArray:
        """Return force and torque of the tissue on the gripper along the tissue axes, (n, 6).

        Parameters
        ----------
        turns : n orientations of the gripper in the source's axes

        Raises
        ------
        InputError
            The wrench is stated along the gripper's axes, and nothing tells these.
        """
        forces = np.stack([self._channel(name, "force", np.nan) for name in WRENCH_COLUMNS[:3]], axis=1)
        torques = np.stack([self._channel(name, "torque", np.nan) for name in WRENCH_COLUMNS[3:]], axis=1)
        axis = self._mapping.machine_axis
        if axis is not None and "f" in self._mapping.channels:
            # the other components are not measured
            along = self._channel("f", "force", np.nan)[:, None] * axis
            forces = np.where(axis != 0, along, forces)
        if self._mapping.force_along == "gripper":
            self._require_orientation()
            forces, torques = (_turned(turns, vectors) for vectors in (forces, torques))
        sign = 1.0 if self._mapping.force_of == "tissue on gripper" else -1.0
        return sign * np.concatenate([frame.vectors(forces), frame.vectors(torques)], axis=1)

    def _require_orientation(self) -> None:
        mapping = self._mapping
        if not any(name in mapping.channels for name in (*QUATERNION, *TURNS)):
            raise InputError(
                f'{mapping.file}: [force] along = "gripper" needs the gripper\'s orientation; name [columns] qw, qx, '
                'qy, qz or rx, ry, rz, or write "source"'
            )

    def beads(self, frame: SourceFrame) -> tuple[FloatArray, FloatArray]:
        """Return the beads (n, m, 3) in the tissue frame, and where they are at rest, (m, 3): in the first row.

        Raises
        ------
        InputError
            One is not seen in the first row, or its place along z is neither measured nor stated.
        """
        stated, file = self._mapping.beads, self._mapping.file
        if not stated.columns:
            return np.zeros((len(self.time), 0, 3)), np.zeros((0, 3))
        places = frame.points(self._points(stated.columns, stated.unit, f"{file}: [beads] columns"))
        rest = places[0].copy()
        if stated.plane_z is not None:
            rest[:, 2] = np.where(np.isfinite(rest[:, 2]), rest[:, 2], stated.plane_z)
        unseen = np.flatnonzero(~np.isfinite(rest).all(axis=1))
        if len(unseen):
            bead = int(unseen[0])
            raise InputError(
                f"{file}: [beads] {stated.columns[bead]} is not seen in the first row in all three axes; leave it out, "
                "begin at another row, or state plane_z"
            )
        return places, rest

    def _points(self, columns: tuple[tuple[str, str, str], ...], unit: str, where: str) -> FloatArray:
        factor = factor_of(unit, "length", where.replace("columns", "unit"))
        nothing = np.full(len(self.time), np.nan)
        return np.stack(
            [
                np.stack([factor * self._column(name, where) if name else nothing for name in names], axis=1)
                for names in columns
            ],
            axis=1,
        )

    def _channel(self, name: str, quantity: Quantity | None, default: float) -> FloatArray:
        channel = self._mapping.channels.get(name)
        if channel is None:
            return np.full(len(self.time), default)
        where = f"{self._mapping.file}: [columns] {name}"
        factor = 1.0 if quantity is None else factor_of(channel.unit, quantity, where)
        return channel.sign * factor * self._column(channel.column, where)

    def _column(self, name: str, where: str) -> FloatArray:
        return at(self._all_times(), self._source, name, self._times, self._base, where)[self._rows]

    def _all_times(self) -> FloatArray:
        return self._times[self._base.name]

    def _base_table(self) -> Table:
        mapping = self._mapping
        named = [
            *(name for names in (*mapping.beads.columns, *mapping.gripper_points) for name in names if name),
            *(mapping.channels[name].column for name in (*POSITIONS, "p") if name in mapping.channels),
            *(channel.column for channel in mapping.channels.values()),
        ]
        if not named:
            raise InputError(f"{mapping.file}: no column is named; write [columns]")
        return self._source.find(named[0], str(mapping.file))[0]
