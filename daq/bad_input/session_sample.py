"""A valid session folder of a few samples and images, sealed or cut off."""

from pathlib import Path

import numpy as np

from daq.bad_input.samples import rig
from daq.recording import schemas
from daq.recording.codec import compressed, raw
from daq.recording.folder import SessionInfo, seal_session, write_info
from daq.recording.mcap_log import McapLog
from daq.recording.reader import open_recording
from daq.recording.rows import EventRows, FrameRows, PoseRows, WrenchRows
from daq.session_report import write_report
from robot_drivers.protocols import Frame, PoseBlock, WrenchBlock

_START_NS = 10**15
_SAMPLES = 40
_PERIOD_NS = 4_000_000


def sealed_session(folder: Path) -> None:
    """Write a sealed session."""
    cut_session(folder)
    seal_session(folder / "session")


def reported_session(folder: Path) -> None:
    """Write a sealed session with the report of its recording."""
    sealed_session(folder)
    write_report(open_recording(folder / "session"), lambda text, done, total: None)


def cut_session(folder: Path) -> None:
    """Write a session whose recorder was killed after the last whole chunk."""
    session = folder / "session"
    session.mkdir()
    rig(session)
    write_info(session, SessionInfo("pull", "P07", 1, trajectory={"kind": "pull"}))
    with McapLog(session / "signals.mcap") as signals:
        _write_events(signals)
        _write_force(signals)
        _write_robot(signals)
    with McapLog(session / "cameras.mcap") as images:
        for name in ("left", "right"):
            _write_images(images, name)


def _write_events(log: McapLog) -> None:
    rows = EventRows(log.add_channel("/events", schemas.EVENT))
    for number in range(4):
        event = {"event": "measure_begin", "row": number, "number": number, "phase": "hold"}
        log.append(rows.pack(event, _START_NS + number * _PERIOD_NS, number))


def _write_force(log: McapLog) -> None:
    rows = WrenchRows(
        log.add_channel("/force/wrench", schemas.WRENCH),
        log.add_channel("/force/device", schemas.DEVICE_STAMP),
        "force_sensor",
    )
    number = np.arange(_SAMPLES)
    block = WrenchBlock(
        counter=number,
        device_time_s=np.linspace(0.0, 0.2, _SAMPLES),
        host_time_ns=_START_NS + number * _PERIOD_NS,
        status=np.zeros(_SAMPLES, np.int64),
        usable=np.ones(_SAMPLES, np.bool_),
        wrench=np.outer(number, [0.1, 0.0, 0.2, 0.0, 0.01, 0.0]),
    )
    log.append(rows.pack(block, 0))


def _write_robot(log: McapLog) -> None:
    rows = PoseRows(
        log.add_channel("/robot/pose", schemas.POSE),
        log.add_channel("/robot/joints", schemas.JOINT_STATE),
        log.add_channel("/robot/device", schemas.DEVICE_STAMP),
        "robot_base",
    )
    number = np.arange(_SAMPLES)
    block = PoseBlock(
        counter=number,
        device_time_s=np.linspace(0.0, 0.2, _SAMPLES),
        host_time_ns=_START_NS + number * _PERIOD_NS,
        position=np.outer(number, [1e-4, 0.0, 0.0]),
        quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (_SAMPLES, 1)),
        joints=np.zeros((_SAMPLES, 6)),
        moving=np.zeros(_SAMPLES, np.bool_),
    )
    log.append(rows.pack(block, 0))


def _write_images(log: McapLog, camera: str) -> None:
    rows = FrameRows(
        log.add_channel(f"/camera/{camera}/image", schemas.COMPRESSED_IMAGE),
        log.add_channel(f"/camera/{camera}/image_raw", schemas.IMAGE),
        log.add_channel(f"/camera/{camera}/device", schemas.DEVICE_STAMP),
        f"camera_{camera}",
    )
    shades = np.arange(16 * 24, dtype=np.uint8).reshape(16, 24)
    for number, encode in enumerate((compressed, raw, compressed)):
        stamp_ns = _START_NS + number * _PERIOD_NS
        log.append(rows.pack(encode(Frame(number, number * 0.04, stamp_ns, "mono8", shades)), number))
