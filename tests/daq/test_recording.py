import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from fake_devices import FakeCamera, FakeForceSensor, FakeRobot
from mcap.reader import make_reader

from daq.devices import Devices
from daq.errors import RecordingError
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
from daq.recording.messages.rows import EventRows, WrenchRows
from daq.recording.reader import Recording
from daq.recording.recorder import Recorder
from daq.recording.recovery import recover_session
from daq.recording.scanning.scan import scan
from daq.recording.sealing.seal import seal
from daq.recording.writer import Packet, RecordWriter
from robot_drivers.errors import DeviceTimeoutError
from robot_drivers.protocols import Frame, Pose, WrenchBlock

REST = Pose((0.4, 0.1, 0.2), (0.5, 0.5, 0.5, 0.5))


def wrench_block(n: int, first: int = 0) -> WrenchBlock:
    counter = first + np.arange(n)
    return WrenchBlock(
        counter=counter,
        device_time_s=counter / 7000,
        host_time_ns=10**15 + counter * 142_857,
        status=np.where(counter % 5 == 4, 0x80020000, 0),
        usable=counter % 5 != 4,
        wrench=counter[:, None] + np.arange(6) / 10,
    )


def write_signals(path: Path, samples: int) -> None:
    """A signals file of a force stream alone."""
    with McapLog(path) as log:
        channels = (
            log.add_channel("/force/wrench", schemas.WRENCH),
            log.add_channel("/force/device", schemas.DEVICE_STAMP),
        )
        rows = WrenchRows(*channels, frame_id="force_sensor")
        for first in range(0, samples, 7):
            log.append(rows.pack(wrench_block(min(7, samples - first), first), first))


def make_session(folder: Path) -> None:
    folder.mkdir()
    write_info(folder, SessionInfo("test", "P1", 1))


def wait_for_samples(recorder: Recorder, least: Mapping[str, int]) -> None:
    """Wait until so many samples of each stream are in the file."""
    deadline = time.monotonic() + 60.0
    while any(recorder.written().get(stream, 0) < count for stream, count in least.items()):
        assert time.monotonic() < deadline, recorder.written()
        time.sleep(0.01)


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    """A short recording of all kinds of device, not sealed."""
    folder = tmp_path / "session"
    make_session(folder)
    force, robot = FakeForceSensor(), FakeRobot(REST)
    force.wrench[:] = 1, 2, 3, 4, 5, 6
    with Recorder(
        folder, Devices(force, robot, {"left": FakeCamera(), "right": FakeCamera("bgr8")})
    ) as recorder:
        recorder.event("begin", text="Ω", value=1.5)
        wait_for_samples(recorder, {"force": 50, "robot": 20, "camera/left": 4, "camera/right": 4})
        recorder.event("end")
    return folder


def test_every_stream_is_read_back_as_the_driver_delivered_it(recorded: Path) -> None:
    recording = Recording(recorded)
    force, robot = recording.force, recording.robot
    assert len(force) > 20
    assert force.counter.tolist() == list(range(len(force)))
    np.testing.assert_array_equal(force.device_time_s, force.counter * 1e-3)
    np.testing.assert_array_equal(force.wrench, np.tile([1.0, 2, 3, 4, 5, 6], (len(force), 1)))
    assert force.usable.all()
    assert robot.counter.tolist() == list(range(len(robot)))
    np.testing.assert_array_equal(robot.position[0], REST.position)
    np.testing.assert_array_equal(robot.quaternion_wxyz[0], REST.quaternion_wxyz)
    assert not robot.moving.any()


def test_images_are_read_back_without_loss(recorded: Path) -> None:
    recording = Recording(recorded)
    assert recording.cameras == ("left", "right")
    for name, camera in (("left", FakeCamera()), ("right", FakeCamera("bgr8"))):
        images = recording.images(name)
        assert len(images) == len(images.counter) > 2
        np.testing.assert_array_equal(images.image(1), camera.image)
        assert images.pixel_format(1) == camera.pixel_format
        np.testing.assert_array_equal(images.device_time_s, (images.counter + 1) / 50)


def test_events_keep_their_order_time_and_details(recorded: Path) -> None:
    begin, end = Recording(recorded).events
    assert (begin.name, begin.details) == ("begin", {"text": "Ω", "value": 1.5})
    assert end.name == "end"
    assert end.time_ns > begin.time_ns


def test_status_counter_and_clock_survive_beside_the_wrench(tmp_path: Path) -> None:
    make_session(tmp_path / "s")
    write_signals(tmp_path / "s" / "signals.mcap", 30)
    write_signals(tmp_path / "s" / "cameras.mcap", 0)
    force = Recording(tmp_path / "s").force
    expected = wrench_block(30)
    for name in ("counter", "device_time_s", "host_time_ns", "status", "usable", "wrench"):
        np.testing.assert_array_equal(getattr(force, name), getattr(expected, name))


def test_sealing_changes_no_message_and_the_library_reads_the_result(recorded: Path) -> None:
    before = Recording(recorded)
    counts = len(before.force), len(before.robot), len(before.images("left")), len(before.events)
    info = seal_session(recorded)
    after = Recording(recorded)
    assert info.state == read_info(recorded).state == "sealed"
    assert counts == (len(after.force), len(after.robot), len(after.images("left")), len(after.events))
    np.testing.assert_array_equal(before.robot.host_time_ns, after.robot.host_time_ns)
    np.testing.assert_array_equal(after.images("right").image(0), FakeCamera("bgr8").image)
    for name in ("signals.mcap", "cameras.mcap"):
        with (recorded / name).open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            summary = reader.get_summary()
            assert summary is not None
            assert summary.statistics is not None
            assert len(summary.chunk_indexes) == summary.statistics.chunk_count > 0
            for channel_id, count in summary.statistics.channel_message_counts.items():
                assert info.samples[summary.channels[channel_id].topic] == count
            assert sum(1 for _ in reader.iter_messages()) == summary.statistics.message_count


def test_a_wrench_message_is_the_ros_2_message_byte_for_byte(tmp_path: Path) -> None:
    path = tmp_path / "signals.mcap"
    write_signals(path, 1)
    found = scan(path)
    (record,) = found.records("/force/wrench")
    header, body = bytes(record[:31]), bytes(record[31:])
    assert header == bytes.fromhex(
        "05 6a00000000000000 0100 00000000 0080c6a47e8d0300 0080c6a47e8d0300".replace(" ", "")
    )
    assert body == bytes.fromhex(
        "00010000"  # encapsulation: CDR, little-endian
        "40420f00 00000000"  # 1 000 000 s, 0 ns
        "0d000000 666f7263655f73656e736f7200 00000000000000"  # "force_sensor" with its NUL, padding to 8
        "0000000000000000 9a9999999999b93f 9a9999999999c93f"
        "333333333333d33f 9a9999999999d93f 000000000000e03f".replace(" ", "")
    )


def test_a_file_cut_at_any_byte_gives_back_every_complete_message(tmp_path: Path) -> None:
    whole = tmp_path / "whole.mcap"
    write_signals(whole, 5)
    data = whole.read_bytes()
    ends = [record_end(data, record) for record in scan(whole).records("/force/wrench")]
    stamp_ends = [record_end(data, record) for record in scan(whole).records("/force/device")]
    path = tmp_path / "cut.mcap"
    first = min(data.index(bytes(record)) for record in scan(whole).records("/force/wrench"))
    for cut in [*range(0, first, 16), *range(first, len(data) + 1)]:
        path.write_bytes(data[:cut])
        expected = sum(end <= cut for end in ends), sum(end <= cut for end in stamp_ends)
        counts = scan(path).counts()
        assert (counts.get("/force/wrench", 0), counts.get("/force/device", 0)) == expected
        if cut % 100 == 0:
            assert seal(path).counts == counts
            assert scan(path).sealed


def record_end(data: bytes, record: memoryview) -> int:
    return data.index(bytes(record)) + len(record)


def test_a_cut_session_is_recovered_with_whole_samples_only(recorded: Path, tmp_path: Path) -> None:
    force, images = len(Recording(recorded).force), len(Recording(recorded).images("left"))
    for name, cut in (("signals.mcap", 700), ("cameras.mcap", 350)):
        os.truncate(recorded / name, (recorded / name).stat().st_size - cut)
    recovery = recover_session(recorded)
    assert recovery.info.state == "recovered"
    assert "cut off" in recovery.info.problems[0]
    assert 0 < recovery.left_out_bytes < 800
    recording = Recording(recorded)
    assert force - 5 <= len(recording.force) <= force
    assert images - 1 <= len(recording.images("left")) <= images
    recording.images("left").image(len(recording.images("left")) - 1)
    assert verify_checksums(recorded) == []


def test_garbage_behind_the_last_record_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "signals.mcap"
    write_signals(path, 5)
    with path.open("ab") as file:
        file.write(bytes(500))  # what a power failure leaves of a file that had grown
    report = seal(path)
    assert report.counts == {"/force/wrench": 5, "/force/device": 5}
    assert report.dropped_bytes == 500


def test_a_sealed_session_is_not_recovered_again(recorded: Path) -> None:
    seal_session(recorded)
    with pytest.raises(RecordingError, match="sealed already"):
        recover_session(recorded)


def test_checksums_tell_an_altered_file(recorded: Path) -> None:
    seal_session(recorded)
    assert verify_checksums(recorded) == []
    with (recorded / "session.json").open("a") as file:
        file.write(" ")
    (recorded / "cameras.mcap").unlink()
    assert verify_checksums(recorded) == ["cameras.mcap", "session.json"]


WRITING_PROCESS = """
import sys, pathlib
sys.path[:0] = {paths!r}
from test_recording import wrench_block
from daq.recording.mcap import schemas
from daq.recording.mcap.chunks import Rows
from daq.recording.mcap.log import McapLog
from daq.recording.messages.rows import EventRows, WrenchRows
log = McapLog(pathlib.Path({path!r}))
channels = log.add_channel("/force/wrench", schemas.WRENCH), log.add_channel("/force/device", schemas.DEVICE_STAMP)
rows = WrenchRows(*channels, "force_sensor")
first = 0
while True:
    log.append(rows.pack(wrench_block(35, first), first))
    first += 35
    print(first, flush=True)
"""


def test_a_killed_process_loses_nothing_that_was_acknowledged(tmp_path: Path) -> None:
    path = tmp_path / "signals.mcap"
    here = Path(__file__)
    program = WRITING_PROCESS.format(paths=[str(here.parents[2]), str(here.parent)], path=str(path))
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if int(line) >= 3500:
                process.send_signal(signal.SIGKILL)
                break
        acknowledged = int((process.stdout.read().splitlines() or [line])[-1])
    report = seal(path)
    assert report.counts["/force/wrench"] >= acknowledged >= 3500


def test_samples_that_the_disk_cannot_take_are_counted_and_told(tmp_path: Path) -> None:
    blocked = BlockedLog(tmp_path / "signals.mcap")
    channel = blocked.add_channel("/events", schemas.EVENT)
    told: list[dict[str, int]] = []

    def tell(dropped: dict[str, int]) -> Packet:
        told.append(dropped)
        return Packet(blocked, EventRows(channel).pack({"event": "samples_dropped"}, 1, 0), "events", 1)

    rows = WrenchRows(channel, channel, "force_sensor").pack(wrench_block(7), 0)
    writer = RecordWriter((blocked,), tell, buffer_bytes=4 * rows.size)
    blocked.block.clear()
    for _ in range(10):
        writer.offer(Packet(blocked, rows, "force", 7))
    blocked.block.set()
    writer.close()
    blocked.close()
    lost = writer.dropped()["force"]
    assert lost >= 5 * 7
    assert writer.written["force"] == 70 - lost
    assert told[-1] == {"force": lost}


class BlockedLog(McapLog):
    """A file on a disk that takes nothing while ``block`` is clear."""

    def __init__(self, path: Path) -> None:
        self.block = threading.Event()
        self.block.set()
        super().__init__(path)

    def append(self, *batch: Rows) -> None:
        self.block.wait()
        super().append(*batch)


def test_a_failing_disk_ends_the_recording_with_a_reason(tmp_path: Path) -> None:
    log = FullLog(tmp_path / "signals.mcap")
    writer = RecordWriter((log,), lambda _: pytest.fail("nothing can be told on a full disk"))
    log.full = True
    writer.offer(Packet(log, WrenchRows(1, 2, "force_sensor").pack(wrench_block(7), 0), "force", 7))
    writer.close()
    log.close()
    with pytest.raises(RecordingError, match="No space left"):
        writer.check()
    assert writer.dropped() == {"force": 7}


class FullLog(McapLog):
    full = False

    def append(self, *batch: Rows) -> None:
        if self.full:
            raise OSError(28, "No space left on device")
        super().append(*batch)


def test_a_device_that_fails_is_told_in_the_recording_and_to_the_session(tmp_path: Path) -> None:
    class FailingCamera(FakeCamera):
        def read(self, timeout_s: float) -> list[Frame]:
            if self.counter == 2:
                raise DeviceTimeoutError("camera left: unplugged")
            return super().read(timeout_s)

    make_session(tmp_path / "s")
    with (
        Recorder(
            tmp_path / "s", Devices(FakeForceSensor(), FakeRobot(REST), {"left": FailingCamera()})
        ) as recorder,
        pytest.raises(DeviceTimeoutError, match="unplugged"),
    ):
        for _ in range(6000):
            time.sleep(0.01)
            recorder.check()
    (event,) = Recording(tmp_path / "s").events
    assert (event.name, event.details["stream"]) == ("device_failed", "camera/left")


def test_a_folder_without_a_session_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"session\.json"):
        Recording(tmp_path)
    (tmp_path / "session.json").write_text(json.dumps({"format": "other/1"}))
    with pytest.raises(RecordingError, match="format"):
        Recording(tmp_path)


def test_a_file_that_is_no_mcap_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("this is no recording")
    with pytest.raises(RecordingError, match="no MCAP file"):
        scan(path)
