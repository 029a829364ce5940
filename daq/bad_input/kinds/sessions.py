"""Session folders that a user hands over, with their readers and verbs."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from daq.bad_input.damage.any_file import BINARY, TEXT, Damage
from daq.bad_input.damage.layout import MCAP
from daq.bad_input.damage.places import PLACES, enormous
from daq.bad_input.damage.recording import RECORDING
from daq.bad_input.damage.value import JSON, TOML
from daq.bad_input.kind import Kind
from daq.bad_input.samples import sessions
from daq.export import sealed_recording
from daq.recording.folder import RIG_FILE
from daq.recording.reader import open_recording
from daq.recording.recovery import recover_session
from daq.rig import read_rig
from daq.session_report import read_report

_SESSION = "session"
# A recording has no largest size: recovery looks through twenty gigabytes, which takes a minute and is no finding.
_PLACES_OF_RECORDINGS = tuple(place for place in PLACES if place is not enormous)


def _read_session(folder: Path) -> object:
    recording = open_recording(folder / _SESSION)
    read_rig(folder / _SESSION / RIG_FILE)
    images = [recording.images(name) for name in recording.cameras]
    decoded = [one.image(number) for one in images for number in range(len(one))]
    return recording.force, recording.robot, recording.events, decoded


def _export(given: Path, out: Path) -> list[str]:
    return ["export", str(given / _SESSION), "--format", "csv", "--output", str(out / "tables")]


def _session(name: str, write: Callable[[Path], None], file: str, damages: Sequence[Damage]) -> Kind:
    """Return the kind of a session folder in which one file is damaged."""
    return Kind(
        name,
        write,
        {f"{_SESSION}/{file}": damages},
        read=_read_session,
        command=_export,
        quick=True,
    )


KINDS: tuple[Kind, ...] = (
    _session("session description", sessions.sealed_session, "session.json", (*TEXT, *JSON)),
    Kind(
        "session's checksums",
        sessions.sealed_session,
        {"session/CHECKSUMS.sha256": TEXT},
        read=lambda folder: sealed_recording(folder / _SESSION),
        command=_export,
    ),
    _session("session's rig", sessions.sealed_session, "rig.toml", (*TEXT, *TOML)),
    Kind(
        "session's report",
        sessions.reported_session,
        {"session/derived/report.json": (*TEXT, *JSON)},
        read=lambda folder: read_report(folder / _SESSION).lines(),
    ),
    _session("signals", sessions.sealed_session, "signals.mcap", (*BINARY, *MCAP, *RECORDING)),
    _session("images", sessions.sealed_session, "cameras.mcap", (*BINARY, *MCAP, *RECORDING)),
    *(
        _session(f"signals, {form}", partial(sessions.rewritten_session, form=form), "signals.mcap", RECORDING)
        for form in sessions.FORMS
    ),
    Kind(
        "sealed session to recover",
        sessions.damaged_session,
        {
            "session/signals.mcap": (*BINARY, *MCAP, *RECORDING),
            "session/cameras.mcap": RECORDING,
            "session/session.json": (*TEXT, *JSON),
            "session/CHECKSUMS.sha256": TEXT,
        },
        read=lambda folder: recover_session(folder / _SESSION),
        command=lambda given, out: ["recover", str(given / _SESSION)],
        places=_PLACES_OF_RECORDINGS,
    ),
    Kind(
        "session for ROS 2",
        sessions.sealed_session,
        {"session/cameras.mcap": (*MCAP, *RECORDING)},
        read=_read_session,
        command=lambda given, out: ["export", str(given / _SESSION), "--format", "ros2", "--output", str(out / "bag")],
        quick=True,
    ),
    Kind(
        "cut session",
        sessions.cut_session,
        {
            "session/signals.mcap": (*BINARY, *MCAP, *RECORDING),
            "session/cameras.mcap": (*BINARY, *MCAP, *RECORDING),
        },
        read=lambda folder: recover_session(folder / _SESSION),
        command=lambda given, out: ["recover", str(given / _SESSION)],
        places=_PLACES_OF_RECORDINGS,
    ),
)  # fmt: skip
