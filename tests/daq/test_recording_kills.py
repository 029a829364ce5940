from pathlib import Path

import pytest

from daq.errors import RecordingError
from daq.recording import folder
from daq.recording.folder import (
    SessionInfo,
    read_info,
    seal_session,
    verify_checksums,
    write_info,
)
from daq.recording.mcap import schemas
from daq.recording.mcap.chunks import Rows
from daq.recording.mcap.log import McapLog
from daq.recording.messages.rows import EventRows
from daq.recording.reader import open_recording
from daq.recording.recovery import recover_session
from daq.recording.scanning.scan import scan
from daq.recording.sealing.seal import seal
from daq.virtual_rig.kill_campaign import campaign
from daq.virtual_rig.load import Load


def event(number: int, channel: int = 1) -> Rows:
    return EventRows(channel).pack({"event": "tick", "number": number}, 10**15 + number, number)


def write_session(folder: Path) -> None:
    folder.mkdir()
    write_info(folder, SessionInfo("cut", "P1", 1))
    McapLog(folder / "cameras.mcap").close()


def test_recordings_killed_at_random_instants_keep_what_was_acknowledged(tmp_path: Path) -> None:
    kills = list(campaign(4, tmp_path, Load(force_rate_hz=2000, frames_per_s=5.0), longest_s=0.7, seed=3))
    assert len(kills) == 4
    for kill in kills:
        assert kill.passed, str(kill)
        assert kill.recovered["force"] >= kill.acknowledged.get("force", 0)
    assert max(kill.acknowledged.get("force", 0) for kill in kills) > 200


def test_opening_a_session_that_was_cut_off_recovers_it_and_says_so(tmp_path: Path) -> None:
    write_session(tmp_path / "s")
    with McapLog(tmp_path / "s" / "signals.mcap") as log:
        log.add_channel("/events", schemas.EVENT)
        log.append(event(0), event(1))
    data = (tmp_path / "s" / "signals.mcap").read_bytes()
    (tmp_path / "s" / "signals.mcap").write_bytes(data[:-70])  # the index and some of the second event
    recording = open_recording(tmp_path / "s")
    assert [one.details["number"] for one in recording.events] == [0]
    assert recording.info.state == "recovered"
    assert recording.info.problems[0].startswith("the recording was cut off and has been recovered; ")
    assert open_recording(tmp_path / "s").info == recording.info


def test_a_session_that_is_being_recorded_is_not_recovered(tmp_path: Path) -> None:
    write_session(tmp_path / "s")
    with McapLog(tmp_path / "s" / "signals.mcap") as log:
        log.add_channel("/events", schemas.EVENT)
        with pytest.raises(RecordingError, match="is being recorded"):
            recover_session(tmp_path / "s")
        with pytest.raises(RecordingError, match="is being recorded"):
            open_recording(tmp_path / "s")
    assert open_recording(tmp_path / "s").info.state == "recovered"


def test_a_disk_that_is_full_in_the_middle_of_a_chunk_leaves_a_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "signals.mcap"
    with McapLog(path) as log:
        log.add_channel("/events", schemas.EVENT)
        log.append(event(0))
        before = path.stat().st_size
        full = FullAfter(log._file, 30)
        log._file = full  # type: ignore[assignment] # a disk with room for 30 bytes more
        with pytest.raises(OSError, match="No space left"):
            log.append(event(1))
        assert path.stat().st_size == before
        full.room = 10**6
        log.append(event(2))
    assert [record[11] for record in scan(path).records("/events")] == [0, 2]


class FullAfter:
    """A file on a disk with room for some bytes."""

    def __init__(self, file: object, room: int) -> None:
        self._file = file
        self.room = room

    def write(self, data: memoryview) -> int:
        if self.room == 0:
            raise OSError(28, "No space left on device")
        taken = min(len(data), self.room)
        self.room -= taken
        return self._file.write(data[:taken])  # type: ignore[attr-defined]

    def __getattr__(self, name: str) -> object:
        return getattr(self._file, name)


def test_sealing_that_was_interrupted_is_finished_by_the_next(tmp_path: Path) -> None:
    path = tmp_path / "signals.mcap"
    with McapLog(path) as log:
        log.add_channel("/events", schemas.EVENT)
        for number in range(5):
            log.append(event(number))
    unsealed = path.read_bytes()
    seal(path)
    sealed = path.read_bytes()
    assert sealed.startswith(unsealed)  # nothing that was recorded is touched
    for length in range(len(unsealed), len(sealed)):
        path.write_bytes(sealed[:length])
        assert seal(path).counts == {"/events": 5}
        assert path.read_bytes() == sealed


def test_a_session_interrupted_at_its_checksums_is_finished_later_and_keeps_what_was_told_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_session(tmp_path / "s")
    with McapLog(tmp_path / "s" / "signals.mcap") as log:
        log.add_channel("/events", schemas.EVENT)
        log.append(event(0))

    def interrupted(path: Path) -> str:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(folder, "sha256", interrupted)
        with pytest.raises(KeyboardInterrupt):
            seal_session(tmp_path / "s", ("3 samples are missing",))
    assert read_info(tmp_path / "s").state == "recording"
    recovery = recover_session(tmp_path / "s")
    info = recovery.info
    assert (info.state, recovery.left_out_bytes, info.samples) == ("recovered", 0, {"/events": 1})
    assert info.problems[0] == "3 samples are missing"
    assert verify_checksums(tmp_path / "s") == []


def test_a_chunk_that_a_loss_of_power_left_half_written_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "signals.mcap"
    with McapLog(path) as log:
        log.add_channel("/events", schemas.EVENT)
        log.append(event(0))
        whole = path.stat().st_size
        log.append(event(1), event(2))
    data = bytearray(path.read_bytes())
    data[whole + 60 : whole + 70] = bytes(10)  # a page that never reached the disk
    path.write_bytes(data)
    assert seal(path).counts == {"/events": 1}
    assert scan(path).sealed
