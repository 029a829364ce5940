"""Files of a session that another program has written again: compressed, without chunks, without checksums."""

from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

from daq.bad_input.recovery.originals import streams_of
from daq.bad_input.samples.sessions import Extent, cut_session, write_again
from daq.errors import RecordingError
from daq.export import sealed_recording
from daq.recording.reader import Recording
from daq.recording.recovery import recover_session
from daq.recording.scanning.scan import scan

EXTENT = Extent(samples=60, samples_in_chunk=6, images=6)
FORMS = {
    "zstd": {"compression": CompressionType.ZSTD},
    "lz4": {"compression": CompressionType.LZ4},
    "none": {"compression": CompressionType.NONE},
    "small chunks": {"compression": CompressionType.LZ4, "chunk_size": 700},
    "no index": {"compression": CompressionType.ZSTD, "index_types": IndexType.NONE},
    "no checksums": {"compression": CompressionType.ZSTD, "enable_crcs": False},
    "no chunks": {"use_chunking": False},
    "no chunks, one checksum": {"use_chunking": False, "enable_data_crcs": True},
    "no summary": {"repeat_channels": False, "repeat_schemas": False, "use_statistics": False},
}
UNCHECKED = ("no checksums", "no chunks")


@pytest.fixture
def session(tmp_path: Path) -> Path:
    cut_session(tmp_path, EXTENT)
    recover_session(tmp_path / "session")
    return tmp_path / "session"


@pytest.mark.parametrize("numbered", [True, False])
@pytest.mark.parametrize("form", FORMS)
def test_a_session_written_again_by_another_program_is_read_as_it_was(
    session: Path, form: str, numbered: bool
) -> None:
    before = streams_of(Recording(session))
    for name in ("signals.mcap", "cameras.mcap"):
        write_again(session / name, numbered=numbered, **FORMS[form])
    recording = Recording(session)
    assert streams_of(recording) == before
    assert (recording.unchecked > 0) == (form in UNCHECKED)


@pytest.mark.parametrize("form", FORMS)
def test_it_is_exported_once_recover_has_checked_it(session: Path, form: str) -> None:
    before = streams_of(Recording(session))
    write_again(session / "signals.mcap", **FORMS[form])
    with pytest.raises(RecordingError, match=r"signals\.mcap differ.*retract recover"):
        sealed_recording(session)
    recovery = recover_session(session)
    assert recovery.lost == {}
    assert streams_of(sealed_recording(session)) == before
    told = any("were not checked" in problem for problem in recovery.info.problems)
    assert told == (form in UNCHECKED)


@pytest.mark.parametrize("form", ["zstd", "lz4", "small chunks", "no index"])
def test_a_damaged_compressed_chunk_is_left_out_and_the_next_one_found(session: Path, form: str) -> None:
    write_again(session / "signals.mcap", **{"chunk_size": 3000, **FORMS[form]})
    before = streams_of(Recording(session))
    with scan(session / "signals.mcap") as found:
        indexes = [segment.index for segment in found.segments]
        place = indexes[len(indexes) // 2].chunk_start_offset + 70
    content = bytearray((session / "signals.mcap").read_bytes())
    content[place : place + 9] = bytes(9)
    (session / "signals.mcap").write_bytes(content)
    recovery = recover_session(session)
    after = streams_of(sealed_recording(session))
    for stream in ("force", "robot"):
        assert after[stream].items() <= before[stream].items()
        told = recovery.lost.get(stream)
        assert len(before[stream]) - len(after[stream]) == (told.samples if told else 0)
    assert len(after["force"]) > 20
    assert len(after["force"]) + len(after["robot"]) < 120


def test_a_break_between_messages_without_chunks_costs_what_it_touches(session: Path) -> None:
    write_again(session / "signals.mcap", use_chunking=False)
    before = streams_of(Recording(session))
    content = (session / "signals.mcap").read_bytes()
    middle = len(content) // 2
    (session / "signals.mcap").write_bytes(content[:middle] + b"\xee" * 900 + content[middle + 900 :])
    recovery = recover_session(session)
    after = streams_of(sealed_recording(session))
    for stream in ("force", "robot"):
        assert after[stream].items() <= before[stream].items()
        told = recovery.lost.get(stream)
        assert len(before[stream]) - len(after[stream]) == (told.samples if told else 0)
    assert len(after["force"]) > 50


def test_without_chunks_a_wrong_checksum_of_the_whole_file_forbids_all_of_it(session: Path) -> None:
    write_again(session / "signals.mcap", use_chunking=False, enable_data_crcs=True)
    content = bytearray((session / "signals.mcap").read_bytes())
    content[len(content) // 2] ^= 1
    (session / "signals.mcap").write_bytes(content)
    with pytest.raises(RecordingError, match="that of the whole file disagrees"):
        Recording(session)
    recovery = recover_session(session)
    assert recovery.lost["force"].samples == 60
    assert len(sealed_recording(session).force) == 0


def test_attachments_and_metadata_are_kept_unless_they_are_damaged(session: Path) -> None:
    with (session / "cameras.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="another program")
        writer.add_attachment(1, 2, "sketch", "text/plain", b"a sketch")
        writer.add_attachment(3, 4, "broken", "text/plain", b"an attachment")
        writer.add_metadata("weather", {"temperature": "21"})
        writer.finish()
    content = (session / "cameras.mcap").read_bytes()
    (session / "cameras.mcap").write_bytes(content.replace(b"an attachment", b"an attachmenT"))
    recovery = recover_session(session)
    assert "CRC of the attachment" in recovery.files["cameras.mcap"].damages[0].what
    with (session / "cameras.mcap").open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert (summary.statistics.attachment_count, summary.statistics.metadata_count) == (1, 1)


def test_an_mcap_file_of_something_else_is_named_with_its_profile_and_library(session: Path) -> None:
    with (session / "signals.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="libmcap 1.3")
        channel = writer.register_channel("/lidar/points", "cdr", 0)
        writer.add_message(channel, 1, b"\0\1\0\0cloud", 1)
        writer.finish()
    with pytest.raises(RecordingError, match=r"profile 'ros2' by 'libmcap 1\.3'.*/lidar/points"):
        Recording(session)
