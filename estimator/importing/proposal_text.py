"""A proposed mapping as a file for the user to complete: what could not be known stands there as "?"."""

import json
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from estimator.importing.mapping import FORMAT, POSITIONS, QUATERNION, TURNS
from estimator.importing.points import Point
from estimator.importing.proposing import Proposal, Proposed
from estimator.importing.table import Table

_OPEN = '"?"'
_MOST_NAMES = 40


def text_of(proposal: Proposal, output: Path) -> str:
    """Return the mapping as TOML, with what each line means beside it."""
    lines = [
        *_head(proposal, output),
        *_clocks(proposal),
        *_columns(proposal),
        *_gripper(proposal),
        *_beads(proposal),
        *_frame(proposal),
        *_body(),
        *_sensor(proposal),
    ]
    return "\n".join(lines) + "\n"


def _head(proposal: Proposal, output: Path) -> Iterator[str]:
    source = proposal.source
    yield f'# How {source.path.name} becomes the experiment {output.name}. Lines with "?" are to be filled in.'
    yield f"# Read as {source.how}:"
    for table in source.tables:
        names = [column.name for column in table.columns]
        shown = ", ".join(names[:_MOST_NAMES]) + (
            f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
        )
        rate = f", {table.rate_hz:g} Hz" if table.rate_hz else ""
        yield from textwrap.wrap(
            f"table {_text(table.name)}, {table.rows} rows{rate}: {shown}",
            width=110,
            initial_indent="#   ",
            subsequent_indent="#     ",
            break_long_words=False,
        )
        for name, value in list(table.facts.items())[:12]:
            yield f"#     {name} = {value}".replace("\n", " ")
    yield f"format = {_text(FORMAT)}"
    yield f"name = {_text(output.name)}"
    yield f"phantom_id = {_text(output.resolve().parent.name or 'phantom')}"
    yield "order = 1                      # of the experiments on this mounting, from 1"
    yield ""
    yield "[rows]                         # of the source, from 1; the first is at rest"
    yield "first = 1"
    yield f"# last = {_base(proposal).rows}"
    yield "most = 60                      # rows that are kept, evenly in time"


def _clocks(proposal: Proposal) -> Iterator[str]:
    for table in _used_tables(proposal):
        yield ""
        yield "[[clock]]"
        yield f"table = {_text(table.name)}"
        time = proposal.times.get(table.name)
        if time is not None:
            yield f"time = {_channel(time)}"
        elif table.rate_hz:
            yield f"rate_hz = {table.rate_hz!r}"
        else:
            yield f"rate_hz = {_OPEN}                  # rows (frames) a second; or instead of it"
            yield '#   time = { column = "...", unit = "s" }'
        yield "offset_s = 0.0                 # added to the time of this table"


def _columns(proposal: Proposal) -> Iterator[str]:
    channels = proposal.channels
    yield ""
    yield "[columns]                      # motion of the gripper, force and torque on it, along the source's axes"
    for target, proposed in channels.items():
        yield f"{target} = {_channel(proposed)}{_hint(proposed)}"
    if not _has_motion(proposal):
        yield f'px = {{ column = {_OPEN}, unit = "mm" }}   # what tells how the gripper moves; or [gripper] columns'
    if proposal.loose_quaternion:
        shown = ", ".join(proposal.loose_quaternion)
        yield f"# the scalar of {shown} is the first or the last; the others follow it in their order"
        for target in QUATERNION:
            yield f"{target} = {{ column = {_OPEN} }}"
    if any(target in channels for target in TURNS):
        told = _OPEN if proposal.turn_form is None else _text(proposal.turn_form)
        yield ""
        yield "[turn]"
        yield f'angles = {told}   # "rotation vector", or the order of turns about x, y, z: "xyz" about fixed axes'
        yield '#   (roll, pitch, yaw), "ZYX" in capitals about axes that turn along'
    if "p" in channels or "f" in channels:
        yield ""
        yield "[machine]"
        yield f"axis = {_OPEN}                     # along which p and f count positive: x, y, z, -x, -y or -z"
    if any(target.startswith("f") for target in channels):
        told = _text(proposal.force_of) if proposal.force_of else _OPEN
        why = "by the work that it does" if proposal.force_of else "its work does not tell"
        yield ""
        yield "[force]"
        yield f'is_of = {told}    # "tissue on gripper" or "gripper on tissue"; {why}'
        if proposal.force_frame:
            yield (
                f"along = {_OPEN}                    # stated in the frame {_text(proposal.force_frame)}: "
                '"gripper" if that turns with it, else "source"'
            )
        yield 'zero = "at rest"               # the mean before any motion counts as zero; or "as it is"'


def _gripper(proposal: Proposal) -> Iterator[str]:
    if not proposal.gripper:
        return
    yield ""
    yield "[gripper]                      # points fixed to it; three or more tell its turn as well"
    yield from _point_list(proposal, proposal.gripper)


def _beads(proposal: Proposal) -> Iterator[str]:
    if not proposal.beads:
        return
    some = (
        f"; {len(proposal.beads)} of {proposal.all_points} points, evenly spread"
        if len(proposal.beads) < proposal.all_points
        else ""
    )
    yield ""
    yield f"[beads]                        # points of the phantom{some}"
    yield from _point_list(proposal, proposal.beads)
    if any(point.columns[2] is None for point in proposal.beads):
        yield f"plane_z = {_OPEN}                  # z of the face that the points are on, m, in the tissue frame"


def _frame(proposal: Proposal) -> Iterator[str]:
    yield ""
    yield "[frame]                        # of the tissue: z up, origin in the phantom's centre at rest"
    axes = ", ".join(_text(axis) for axis in proposal.axes)
    yield f"axes = [{axes}]         # its x, y, z along the source's axes"
    if proposal.beads:
        places = np.array([point.start for point in proposal.beads])
        ranges = ", ".join(
            f"{axis} {np.nanmin(places[:, k]):.5g} to {np.nanmax(places[:, k]):.5g}"
            for k, axis in enumerate("xyz")
            if np.isfinite(places[:, k]).any()
        )
        unit = proposal.beads[0].unit or "in the source's unit"
        yield f"origin = {_OPEN}                   # the phantom's centre in the source's axes, [x, y, z] in m"
        yield f"                               # (the points span {ranges} {unit})"


def _body() -> Iterator[str]:
    yield from (
        "",
        "[phantom]",
        f"shape = {_OPEN}                    # block, cylinder (around z) or surface",
        f"size = {_OPEN}                     # edges [x, y, z] in m; of a cylinder [diameter, diameter, height]",
        '# surface = "phantom.stl"      # of a surface, which needs no size; beside this file',
        "density = 1070.0               # kg/m3, supposed",
        "# stays_flat = true            # of a thin sheet that stays in its plane",
        "",
        "[grasp]                        # what moves with the gripper",
        f'box = {_OPEN}                      # two corners in m, or a face and a depth in m: "x+ 0.002"',
        "# centre = [0.0, 0.0, 0.0]     # the gripper's origin at rest, m; the middle of the face without it",
        "",
        "[[anchor]]                     # what stands still; repeat for more",
        f"box = {_OPEN}",
        "# [[roller]]                   # what slides but along some directions, as on a smooth plate",
        '# box = "z-"',
        '# directions = ["z"]',
        "",
        "[environment]",
        "gravity = [0.0, 0.0, -9.81]    # m/s2 in the tissue frame, supposed",
        f'surface_below = {_OPEN}            # "table" if the phantom lies on one, else "none"',
    )


def _sensor(proposal: Proposal) -> Iterator[str]:
    yield ""
    yield "[sensor]                       # standard deviation of one value"
    measured = {
        "force_std": any(target.startswith("f") for target in proposal.channels),
        "torque_std": any(target.startswith("t") for target in proposal.channels),
        "fiducial_std": bool(proposal.beads),
    }
    units = {"force_std": "N", "torque_std": "N·m", "fiducial_std": "m"}
    usual = {"force_std": "0.01", "torque_std": "0.01", "fiducial_std": "0.0001"}
    for name, there in measured.items():
        if not there:
            yield f"{name} = {usual[name]}    # {units[name]}; not measured"
        elif name in proposal.noise:
            yield f"{name} = {proposal.noise[name]!r}    # {units[name]}, from the rows at rest"
        else:
            yield f"{name} = {_OPEN}    # {units[name]}"
    yield "position_std = 2e-05    # m, of the gripper, supposed"


def _point_list(proposal: Proposal, points: Sequence[Point]) -> Iterator[str]:
    units = {point.unit for point in points}
    unit = next(iter(units)) if len(units) == 1 else None
    said = "" if unit else '   # of these columns; of pixels what one is, as in "0.054 mm"'
    yield f"unit = {_text(unit) if unit else _OPEN}{said}"
    yield "columns = [                    # along the source's x, y, z"
    for point in points:
        names = [proposal.source.name_of(point.table, column) if column else "" for column in point.columns]
        yield f"    [{', '.join(map(_text, names))}],"
    yield "]"


def _has_motion(proposal: Proposal) -> bool:
    return bool(proposal.gripper) or any(target in proposal.channels for target in (*POSITIONS, "p"))


def _base(proposal: Proposal) -> Table:
    """Return the table whose rows are kept: that of the points, else that of the motion, else the first."""
    for point in (*proposal.beads, *proposal.gripper):
        return point.table
    for target in (*POSITIONS, "p"):
        if target in proposal.channels:
            return proposal.channels[target].table
    return proposal.source.tables[0]


def _used_tables(proposal: Proposal) -> list[Table]:
    used = {_base(proposal).name, *(one.table.name for one in proposal.channels.values())}
    return [table for table in proposal.source.tables if table.name in used]


def _channel(proposed: Proposed) -> str:
    unit = f", unit = {_text(proposed.unit) if proposed.unit else _OPEN}" if proposed.needs_unit else ""
    return f"{{ column = {_text(proposed.name)}{unit} }}"


def _hint(proposed: Proposed) -> str:
    """Return what to write for a unit that is not known."""
    if not proposed.needs_unit or proposed.unit:
        return ""
    if proposed.target == "p":
        return '   # of strain it is the gauge length, as in "82 mm"'
    if proposed.target == "f":
        return '   # of stress it is what acts on the section, as in "0.01 N" for 1 kPa on 10 mm2'
    return ""


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
