"""A session that is synchronised while it is recorded gives what it would give as a whole."""

import math
import random
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from synthetic_session import MOVE_S, START_NS, WINDOW_S, SyntheticSession

from daq.errors import RecordingError
from daq.frames import pose
from daq.progress import silent
from daq.recording.reader import Recording
from daq.recording.running import RunningRecording
from daq.recording.scanning.scan import scan, scan_on
from daq.recording.scanning.segments import Scan
from daq.rig import Rig
from daq.synchronisation.experiment_rows import Synchronised, synchronise
from daq.synchronisation.exposed_images import Track, bead_tracker
from daq.synchronisation.running import PAIRS_PER_S, RunningSynchronisation
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.vision.fiducials import FiducialObservation
from robot_drivers.protocols import Pose

PHANTOM = SpringPhantom(GRASP_CENTRE, placed_beads(3))
LOGS = ("signals.mcap", "cameras.mcap")
PERIOD_S = WINDOW_S + MOVE_S
ROWS = ("time", "step", "position", "quaternion_wxyz", "wrench", "fiducials", "fiducials_rest")


def twisted(way_m: float, angle_deg: float) -> Pose:
    turn = Rotation.from_rotvec([math.radians(angle_deg), 0.0, 0.0])
    return pose((0.04 + way_m, 0.0, 0.0), turn)


POSES = (twisted(0.0, 0.0), twisted(0.003, 20.0), twisted(0.006, 45.0))


class Growing:
    """A copy of a session folder that grows chunk by chunk, in the order of their times, as a recorder's does."""

    def __init__(self, whole: Path, folder: Path) -> None:
        self.folder = folder
        shutil.copytree(whole, folder, ignore=shutil.ignore_patterns(*LOGS))
        self._logs = {log: _in_order((whole / log).read_bytes(), scan(whole / log)) for log in LOGS}
        self.until(-math.inf)

    def until(self, time_s: float, *logs: str) -> None:
        """Write the chunks that had begun by a time, of all logs or of some."""
        for log in logs or LOGS:
            declared, chunks = self._logs[log]
            begun = [chunk for begin_s, chunk in chunks if begin_s <= time_s]
            (self.folder / log).write_bytes(b"".join([declared, *begun]))


def _in_order(content: bytes, found: Scan) -> tuple[bytes, list[tuple[float, bytes]]]:
    """Return what lies outside of the chunks of a log, and its chunks by the time of their first message, s."""
    declared, chunks, position = b"", [], 0
    for segment in found.segments:
        index = segment.index
        assert index is not None
        end = index.chunk_start_offset + index.chunk_length + index.message_index_length
        declared += content[position : index.chunk_start_offset]
        begin_s = (index.message_start_time - START_NS) * 1e-9
        chunks.append((begin_s, content[index.chunk_start_offset : end]))
        position = end
    return declared + content[position:], sorted(chunks, key=lambda chunk: chunk[0])


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    session = SyntheticSession(POSES, PHANTOM, frame_rate=4.0)
    return session.write(tmp_path_factory.mktemp("synthetic") / "session")


@pytest.fixture(scope="module")
def together(whole: Path) -> Synchronised:
    """The whole session, synchronised at once."""
    return synchronise(Recording(whole), silent)


@pytest.fixture
def growing(whole: Path, tmp_path: Path) -> Growing:
    return Growing(whole, tmp_path / "growing")


def assert_same(one: Synchronised, other: Synchronised) -> None:
    for name in ROWS:
        np.testing.assert_array_equal(getattr(one.experiment, name), getattr(other.experiment, name), name)
    assert one.experiment.sensor == other.experiment.sensor
    assert one.experiment.phase == other.experiment.phase
    assert one.samples == other.samples
    assert one.windows == other.windows


def test_after_each_step_the_rows_are_those_of_the_whole_recording_so_far(growing: Growing) -> None:
    running, rows = RunningSynchronisation(growing.folder), []
    for tenth in range(round(10 * len(POSES) * PERIOD_S) + 2):
        growing.until(0.1 * tenth)
        if (found := running.read_on()) is not None:
            rows.append(len(found.experiment.time))
            assert_same(found, synchronise(Recording(growing.folder), silent))
    assert rows == [1, 2, 3]


def test_who_is_late_gets_the_steps_one_by_one_from_fewer_pairs(
    growing: Growing, together: Synchronised
) -> None:
    running = RunningSynchronisation(growing.folder)
    assert running.read_on() is None
    growing.until(math.inf)
    found = [running.read_on() for _ in POSES]
    assert [None if one is None else len(one.experiment.time) for one in found] == [1, 2, 3]
    assert running.read_on() is None
    last = found[-1]
    assert last is not None
    for name in ("step", "position", "quaternion_wxyz", "wrench"):
        np.testing.assert_array_equal(
            getattr(last.experiment, name), getattr(together.experiment, name), name
        )
    fewer, all_pairs = last.samples["camera left"], together.samples["camera left"]
    assert max(fewer[:-1]) < min(all_pairs[:-1])  # once it has caught up it looks at all again
    assert fewer[-1] == all_pairs[-1]
    np.testing.assert_allclose(last.experiment.fiducials, together.experiment.fiducials, atol=2e-5)


def test_a_step_is_no_row_before_every_stream_is_beyond_it(growing: Growing) -> None:
    running = RunningSynchronisation(growing.folder)
    growing.until(PERIOD_S)
    assert running.read_on() is not None
    growing.until(2 * PERIOD_S, "signals.mcap")
    assert running.read_on() is None
    growing.until(2 * PERIOD_S)
    found = running.read_on()
    assert found is not None
    assert np.isfinite(found.experiment.fiducials).all()


def test_no_pair_of_images_is_looked_at_twice(growing: Growing, monkeypatch: pytest.MonkeyPatch) -> None:
    times: list[float] = []

    def counting(rig: Rig) -> Track:
        track = bead_tracker(rig)

        def update(images: Sequence[NDArray[np.uint8]], time_s: float) -> FiducialObservation:
            times.append(time_s)
            return track(images, time_s)

        return update

    monkeypatch.setattr("daq.synchronisation.running.bead_tracker", counting)
    running = RunningSynchronisation(growing.folder)
    for half in range(2 * len(POSES) * 2):
        growing.until(0.5 * half)
        running.read_on()
    assert len(times) > 10
    assert min(np.diff(times)) > 0.2  # four images a second


def test_a_file_read_on_in_pieces_that_end_anywhere_gives_every_message_once(
    whole: Path, tmp_path: Path
) -> None:
    content, chance = (whole / "signals.mcap").read_bytes(), random.Random(1)
    growing, part, records = tmp_path / "signals.mcap", Scan(), b""
    for end in sorted([*chance.choices(range(len(content)), k=40), len(content)]):
        growing.write_bytes(content[:end])
        part = scan_on(growing, part)
        records += b"".join(part.records("/force/wrench"))
    found = scan(whole / "signals.mcap")
    assert records == b"".join(found.records("/force/wrench")) != b""


def test_pixels_that_were_let_go_are_gone_and_their_stamps_stay(growing: Growing) -> None:
    growing.until(math.inf)
    recording = RunningRecording(growing.folder)
    recording.read_on()
    images = recording.images("left")
    recording.let_go_images(int(images.host_time_ns[2]))
    left = recording.images("left")
    np.testing.assert_array_equal(left.host_time_ns, images.host_time_ns)
    np.testing.assert_array_equal(left.image(2), images.image(2))
    with pytest.raises(RecordingError, match="image 1 of the recording cannot be decoded"):
        left.image(1)


def test_of_fast_cameras_some_pairs_are_looked_at_as_of_the_whole_with_as_many(tmp_path: Path) -> None:
    session = SyntheticSession(POSES[:2], PHANTOM, frame_rate=10.0)
    growing = Growing(session.write(tmp_path / "session"), tmp_path / "growing")
    running, found = RunningSynchronisation(growing.folder), None
    for tenth in range(round(10 * 2 * PERIOD_S) + 2):
        growing.until(0.1 * tenth)
        found = running.read_on() or found
    assert found is not None
    recording = Recording(growing.folder)
    assert_same(found, synchronise(recording, silent, PAIRS_PER_S))
    most = max(found.samples["camera left"])
    assert most <= math.ceil(5.0 * WINDOW_S) < min(synchronise(recording, silent).samples["camera left"])


def test_what_nobody_writes_any_more_is_not_waited_for(growing: Growing) -> None:
    """The recorder has closed its files, and the seal is still to come."""
    running = RunningSynchronisation(growing.folder)
    growing.until(PERIOD_S)
    assert running.read_on() is not None
    growing.until(2 * PERIOD_S, "signals.mcap")
    assert running.read_on() is None
    found = running.read_rest()
    assert found is not None
    assert len(found.experiment.time) == 2
