"""A valid session folder of a few samples and images, sealed or cut off."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from daq.bad_input.samples.laboratory import rig
from daq.recording.folder import RIG_FILE, SessionInfo, seal_session, sha256, write_info
from daq.recording.mcap import schemas
from daq.recording.mcap.chunks import Rows
from daq.recording.mcap.log import McapLog
from daq.recording.messages.codec import compressed, raw
from daq.recording.messages.rows import EventRows, FrameRows, PoseRows, WrenchRows
from daq.recording.reader import open_recording
from daq.recording.recovery import recover_session
from daq.session_report import write_report
from robot_drivers.protocols import Frame, PoseBlock, WrenchBlock

_START_NS = 10**15
_PERIOD_NS = 4_000_000


@dataclass(frozen=True, slots=True)
class Extent:
    """How much a session holds: samples of force and robot, how many of them are in a chunk, images of each camera."""

    samples: int = 40
    samples_in_chunk: int = 40
    images: int = 3


SMALL = Extent()


def sealed_session(folder: Path, extent: Extent = SMALL) -> None:
    """Write a sealed session."""
    cut_session(folder, extent)
    seal_session(folder / "session")


def damaged_session(folder: Path) -> None:
    """Write a sealed session with other bytes in the middle of its signals."""
    sealed_session(folder, Extent(samples_in_chunk=10))
    file = folder / "session" / "signals.mcap"
    content = bytearray(file.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 4] = b"\xa5\x5a\xa5\x5a"
    file.write_bytes(content)


FORMS: dict[str, dict[str, Any]] = {
    "zstd": {"compression": CompressionType.ZSTD, "chunk_size": 4000},
    "lz4": {"compression": CompressionType.LZ4, "chunk_size": 4000},
    "without chunks": {"use_chunking": False},
}
"""How the MCAP library's own writer writes a file again."""


def rewritten_session(folder: Path, form: str) -> None:
    """Write a sealed session whose signals another program has written again before."""
    cut_session(folder)
    recover_session(folder / "session")
    write_again(folder / "session" / "signals.mcap", **FORMS[form])
    recover_session(folder / "session")


def write_again(file: Path, *, numbered: bool = True, **form: Any) -> None:
    """Write the messages of a sealed file again with the MCAP library's writer.

    Parameters
    ----------
    numbered : whether the messages keep their sequence numbers
    form : options of that writer
    """
    draft = file.with_suffix(".again")
    schemas: dict[int, int] = {0: 0}
    channels: dict[int, int] = {}
    with file.open("rb") as source, draft.open("wb") as target:
        writer = Writer(target, **form)
        writer.start(profile="ros2", library="another program")
        for schema, channel, message in make_reader(source).iter_messages(log_time_order=False):
            if schema is not None and schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[channel.schema_id]
                )
            sequence = message.sequence if numbered else 0
            times = message.log_time, message.publish_time
            writer.add_message(channels[channel.id], times[0], message.data, times[1], sequence)
        writer.finish()  # type: ignore[no-untyped-call] # the library leaves it untyped
    draft.replace(file)


def reported_session(folder: Path) -> None:
    """Write a sealed session with the report of its recording."""
    sealed_session(folder)
    write_report(open_recording(folder / "session"), lambda text, done, total: None)


def cut_session(folder: Path, extent: Extent = SMALL) -> None:
    """Write a session whose recorder was killed after the last whole chunk."""
    session = folder / "session"
    session.mkdir()
    rig(session)
    checksums = {RIG_FILE: sha256(session / RIG_FILE)}
    write_info(session, SessionInfo("pull", "P07", 1, trajectory={"kind": "pull"}, checksums=checksums))
    with McapLog(session / "signals.mcap") as signals:
        _write_signals(signals, extent)
    with McapLog(session / "cameras.mcap") as images:
        _write_images(images, extent)


def _write_signals(log: McapLog, extent: Extent) -> None:
    event_rows = EventRows(log.add_channel("/events", schemas.EVENT))
    wrench_rows = WrenchRows(
        log.add_channel("/force/wrench", schemas.WRENCH),
        log.add_channel("/force/device", schemas.DEVICE_STAMP),
        "force_sensor",
    )
    pose_rows = PoseRows(
        log.add_channel("/robot/pose", schemas.POSE),
        log.add_channel("/robot/joints", schemas.JOINT_STATE),
        log.add_channel("/robot/device", schemas.DEVICE_STAMP),
        "robot_base",
    )
    force, robot = _force(extent.samples), _robot(extent.samples)
    for number, first in enumerate(range(0, extent.samples, extent.samples_in_chunk)):
        chosen = slice(first, first + extent.samples_in_chunk)
        batch = [wrench_rows.pack(_part(force, chosen), first), pose_rows.pack(_part(robot, chosen), first)]
        log.append(*batch, *_event(event_rows, number))
    for number in range(-(-extent.samples // extent.samples_in_chunk), 4):
        log.append(*_event(event_rows, number))


def _event(rows: EventRows, number: int) -> tuple[Rows]:
    event = {"event": "measure_begin", "row": number, "number": number, "phase": "hold"}
    return (rows.pack(event, _START_NS + number * _PERIOD_NS, number),)


def _part(block: Any, chosen: slice) -> Any:
    return type(block)(**{one.name: getattr(block, one.name)[chosen] for one in fields(block)})


def _force(samples: int) -> WrenchBlock:
    number = np.arange(samples)
    return WrenchBlock(
        counter=number,
        device_time_s=np.linspace(0.0, 0.2, samples),
        host_time_ns=_START_NS + number * _PERIOD_NS,
        status=np.zeros(samples, np.int64),
        usable=np.ones(samples, np.bool_),
        wrench=np.outer(number, [0.1, 0.0, 0.2, 0.0, 0.01, 0.0]),
    )


def _robot(samples: int) -> PoseBlock:
    number = np.arange(samples)
    return PoseBlock(
        counter=number,
        device_time_s=np.linspace(0.0, 0.2, samples),
        host_time_ns=_START_NS + number * _PERIOD_NS,
        position=np.outer(number, [1e-4, 0.0, 0.0]),
        quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (samples, 1)),
        joints=np.zeros((samples, 6)),
        moving=np.zeros(samples, np.bool_),
    )


def _write_images(log: McapLog, extent: Extent) -> None:
    rows = {
        camera: FrameRows(
            log.add_channel(f"/camera/{camera}/image", schemas.COMPRESSED_IMAGE),
            log.add_channel(f"/camera/{camera}/image_raw", schemas.IMAGE),
            log.add_channel(f"/camera/{camera}/device", schemas.DEVICE_STAMP),
            f"camera_{camera}",
        )
        for camera in ("left", "right")
    }
    for number in range(extent.images):
        shades = (np.arange(16 * 24) * (number + 1)).astype(np.uint8).reshape(16, 24)
        stamp_ns = _START_NS + number * _PERIOD_NS
        encode = raw if number % 3 == 1 else compressed
        for each in rows.values():
            log.append(each.pack(encode(Frame(number, number * 0.04, stamp_ns, "mono8", shades)), number))
