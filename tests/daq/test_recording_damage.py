"""Sessions damaged anywhere: nothing undamaged is lost, nothing damaged is used, and the loss is told."""

import json
import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.bad_input.damage.recording import chunks
from daq.bad_input.recovery.checks import judge_damage
from daq.bad_input.recovery.originals import Original, originals, streams_of
from daq.bad_input.recovery_campaign import main as campaign
from daq.bad_input.samples.sessions import Extent, cut_session, sealed_session
from daq.cli import main
from daq.errors import RecordingError
from daq.export import export_tables, sealed_recording
from daq.progress import silent
from daq.recording.folder import read_info
from daq.recording.reader import Recording, open_recording
from daq.recording.recovery import recover_session
from daq.recording.scanning.scan import scan

EXTENT = Extent(samples=60, samples_in_chunk=6, images=6)


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> list[Original]:
    return originals(tmp_path_factory.mktemp("sessions"))


@pytest.fixture
def sealed(tmp_path: Path) -> Path:
    sealed_session(tmp_path, EXTENT)
    return tmp_path / "session"


@pytest.fixture
def cut(tmp_path: Path) -> Path:
    cut_session(tmp_path, EXTENT)
    return tmp_path / "session"


def change(file: Path, edit: Callable[[bytes], bytes]) -> None:
    file.write_bytes(edit(file.read_bytes()))


def overwrite(file: Path, place: int, piece: bytes) -> None:
    change(file, lambda data: data[:place] + piece + data[place + len(piece) :])


def test_whatever_befalls_a_session_anywhere_what_is_undamaged_is_kept_and_the_loss_is_told(
    sessions: list[Original], tmp_path: Path
) -> None:
    @settings(deadline=None, derandomize=True, max_examples=40, database=None)
    @given(
        original=st.sampled_from(sessions),
        file=st.sampled_from(
            ["signals.mcap", "signals.mcap", "cameras.mcap", "session.json", "CHECKSUMS.sha256"]
        ),
        place=st.floats(0.0, 1.0),
        length=st.integers(0, 5000),
        piece=st.one_of(st.binary(max_size=40), st.integers(0, 5000).map(bytes)),
        seed=st.integers(0, 1000),
    )
    def holds(original: Original, file: str, place: float, length: int, piece: bytes, seed: int) -> None:
        content = original.files.get(file)
        if content is None:
            return
        begin = round(place * len(content))
        damaged = content[:begin] + piece + content[begin + length :]
        folder = tmp_path / "session"
        verdict = judge_damage(original, file, damaged, "replaced", Random(seed), folder)
        shutil.rmtree(folder)
        assert not verdict.complaint

    holds()


def test_a_campaign_finds_nothing_and_goes_on_where_it_was_interrupted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = tmp_path / "results.jsonl"
    assert campaign(["--count", "20", "--seed", "5", "--results", str(results)]) == 0
    assert len(results.read_text().splitlines()) == 20
    before = capsys.readouterr().out.rpartition("\n")[0].rpartition("\n")[0]
    assert campaign(["--count", "20", "--seed", "5", "--results", str(results)]) == 0
    assert len(results.read_text().splitlines()) == 20
    assert capsys.readouterr().out.startswith(before)
    assert before.splitlines()[-1].split()[:2] == ["all", "20"]


def test_a_chunk_in_the_middle_whose_values_changed_is_left_out_and_told_by_stream(cut: Path) -> None:
    file = cut / "signals.mcap"
    begin, _ = chunks(file.read_bytes())[4]
    overwrite(file, begin + 200, bytes(8))
    recovery = recover_session(cut)
    assert {stream: loss.samples for stream, loss in recovery.lost.items()} == {
        "force": 6,
        "robot": 6,
        "events": 1,
    }
    assert not any(loss.estimated for loss in recovery.lost.values())
    assert recovery.left_out_bytes > 0
    (damage,) = recovery.files["signals.mcap"].damages
    assert (damage.start, damage.what) == (begin, f"CRC of the chunk at byte {begin} disagrees")
    assert sorted(set(range(60)) - set(Recording(cut).force.counter.tolist())) == list(range(24, 30))
    problems = " ".join(read_info(cut).problems)
    assert "force 6" in problems
    assert f"CRC of the chunk at byte {begin} disagrees" in problems


def test_what_is_behind_a_chunk_whose_head_was_overwritten_is_found(cut: Path) -> None:
    file = cut / "signals.mcap"
    begin, _ = chunks(file.read_bytes())[2]
    overwrite(file, begin, b"\xa5" * 60)
    assert len(Recording(cut).force) == 54
    assert recover_session(cut).lost["force"].samples == 6


def test_a_damaged_sealed_session_is_refused_in_one_line_and_recovered(
    sealed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = sealed / "signals.mcap"
    begin, _ = chunks(file.read_bytes())[2]
    overwrite(file, begin + 300, b"\xff" * 8)
    damaged = file.read_bytes()
    for arguments in (
        ["replay", str(sealed)],
        ["export", str(sealed), "--output", str(sealed.parent / "out")],
    ):
        assert main(arguments) == 2
        told = capsys.readouterr().err
        assert len(told.splitlines()) == 1
        assert f"CRC of the chunk at byte {begin} disagrees" in told
        assert "retract recover" in told
    assert file.read_bytes() == damaged
    assert main(["recover", str(sealed)]) == 0
    said = capsys.readouterr().out
    assert "6  samples of force lost" in said
    assert f"bytes {begin} to " in said
    assert len(sealed_recording(sealed).force) == 54
    assert main(["recover", str(sealed)]) == 2


def test_the_end_of_a_sealed_session_is_missed_exactly_and_of_a_cut_one_about(
    sealed: Path, tmp_path: Path
) -> None:
    begin, end = chunks((sealed / "signals.mcap").read_bytes())[-2]
    os.truncate(sealed / "signals.mcap", begin + 100)
    lost = recover_session(sealed).lost
    assert (lost["force"].samples, lost["force"].estimated) == (12, False)
    (tmp_path / "other").mkdir()
    cut_session(tmp_path / "other", EXTENT)
    cut = tmp_path / "other" / "session"
    overwrite(cut / "signals.mcap", begin + 100, b"\xff" * (end - begin))
    loss = recover_session(cut).lost["force"]
    assert loss.estimated
    assert 3 <= loss.samples <= 20


def test_declarations_that_are_gone_are_made_good_by_the_messages(cut: Path) -> None:
    for name in ("signals.mcap", "cameras.mcap"):
        first, _ = chunks((cut / name).read_bytes())[0]
        overwrite(cut / name, 8, b"\0" * (first - 8))
    before = streams_of(Recording(cut))
    assert len(before["force"]) == len(before["robot"]) == 60
    assert len(before["camera/left"]) == len(before["camera/right"]) == 6
    recovery = recover_session(cut)
    assert recovery.lost == {}
    assert any("declaration of channel" in note for note in recovery.files["signals.mcap"].notes)
    assert streams_of(Recording(cut)) == before


def test_a_topic_that_was_altered_is_corrected(cut: Path) -> None:
    change(cut / "signals.mcap", lambda data: data.replace(b"/force/wrench", b"/force/wrinch"))
    assert len(Recording(cut).force) == 60


@pytest.mark.parametrize("place", ["footer", "summary", "statistics", "end of the data"])
def test_a_damaged_summary_costs_no_message(sealed: Path, place: str) -> None:
    content = (sealed / "signals.mcap").read_bytes()
    where = {
        "footer": len(content) - 20,
        "summary": chunks(content)[-1][1] + 13 + 40,
        "statistics": len(content) - 300,
        "end of the data": chunks(content)[-1][1] + 2,
    }[place]
    overwrite(sealed / "signals.mcap", where, b"\x5a" * 3)
    with pytest.raises(RecordingError, match="is damaged"):
        Recording(sealed)
    recovery = recover_session(sealed)
    assert recovery.lost == {}
    assert len(sealed_recording(sealed).force) == 60


def test_chunks_that_changed_places_or_stand_there_twice_give_every_sample_once(cut: Path) -> None:
    content = (cut / "signals.mcap").read_bytes()
    before = streams_of(Recording(cut))
    (a, b), (c, d) = chunks(content)[1], chunks(content)[5]
    (cut / "signals.mcap").write_bytes(content[:a] + content[c:d] + content[b:c] + content[a:b] + content[c:])
    assert streams_of(Recording(cut)) == before
    recovery = recover_session(cut)
    assert recovery.lost == {}
    assert "repeats the chunk" in recovery.files["signals.mcap"].damages[0].what


@pytest.mark.parametrize("content", ["nothing", "zeros", "missing"])
def test_signals_are_saved_where_nothing_is_left_of_the_images(sealed: Path, content: str) -> None:
    file = sealed / "cameras.mcap"
    change(file, lambda data: b"" if content == "nothing" else bytes(len(data)))
    if content == "missing":
        file.unlink()
    recovery = recover_session(sealed)
    assert {stream: loss.samples for stream, loss in recovery.lost.items()} == {
        "camera/left": 6,
        "camera/right": 6,
    }
    assert len(sealed_recording(sealed).force) == 60


def test_what_is_no_recording_is_named_and_nothing_is_touched(sealed: Path) -> None:
    (sealed / "cameras.mcap").write_bytes(b"%PDF-1.7 and so on")
    before = {path: path.read_bytes() for path in sealed.iterdir()}
    with pytest.raises(RecordingError, match=r"is no MCAP file; it begins with b'%PDF-1\.7"):
        recover_session(sealed)
    assert {path: path.read_bytes() for path in sealed.iterdir()} == before


@pytest.mark.parametrize("content", [None, "", "{", '{"format": "other/1"}'])
def test_a_session_without_its_description_is_recovered_with_a_new_one(
    sealed: Path, content: str | None
) -> None:
    (sealed / "session.json").unlink()
    if content is not None:
        (sealed / "session.json").write_text(content)
    with pytest.raises(RecordingError, match="retract recover"):
        open_recording(sealed)
    info = recover_session(sealed).info
    assert (info.name, info.phantom_id, info.state) == ("session", "virtual", "recovered")
    assert any("written anew" in problem for problem in info.problems)
    assert len(sealed_recording(sealed).force) == 60
    assert not content or (sealed / "session.json.damaged").read_text() == content


def test_a_session_of_a_later_version_is_not_taken_for_a_damaged_one(sealed: Path) -> None:
    change(
        sealed / "session.json", lambda data: data.replace(b"retraction-session/1", b"retraction-session/2")
    )
    before = (sealed / "session.json").read_bytes()
    with pytest.raises(RecordingError, match="is not of the format"):
        recover_session(sealed)
    assert (sealed / "session.json").read_bytes() == before


def test_a_session_whose_rig_file_was_altered_is_not_sealed_with_it(sealed: Path) -> None:
    overwrite(sealed / "signals.mcap", 5000, b"\xff" * 8)
    change(sealed / "rig.toml", lambda data: data + b"\n")
    before = (sealed / "signals.mcap").read_bytes()
    with pytest.raises(RecordingError, match=r"rig\.toml differ"):
        recover_session(sealed)
    assert (sealed / "signals.mcap").read_bytes() == before
    assert read_info(sealed).state == "sealed"


@pytest.mark.skipif(sys.platform != "linux", reason="looks up the name of an open file")
def test_a_damaged_file_stays_where_its_copy_cannot_be_written(
    sealed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    overwrite(sealed / "signals.mcap", 5000, b"\xff" * 8)
    before = {path.name: path.read_bytes() for path in sealed.iterdir()}

    def full(descriptor: int) -> None:
        if "recovered" in str(Path(f"/proc/self/fd/{descriptor}").readlink()):
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(RecordingError, match="no room"):
        recover_session(sealed)
    assert {path.name: path.read_bytes() for path in sealed.iterdir()} == before


def test_a_checksum_that_was_set_to_none_is_no_licence_for_a_changed_value(cut: Path) -> None:
    begin, _ = chunks((cut / "signals.mcap").read_bytes())[3]
    overwrite(cut / "signals.mcap", begin + 33, bytes(4))
    overwrite(cut / "signals.mcap", begin + 200, b"\x7f" * 4)
    assert len(Recording(cut).force) == 54


def test_a_length_in_the_head_of_a_chunk_is_looked_for_among_its_copies(cut: Path) -> None:
    begin, _ = chunks((cut / "signals.mcap").read_bytes())[3]
    overwrite(cut / "signals.mcap", begin + 1, b"\xff\xff")
    assert len(Recording(cut).force) == 60
    assert recover_session(cut).lost == {}


def test_damage_that_sealing_finds_is_told_in_the_session(cut: Path) -> None:
    from daq.recording.folder import seal_session

    begin, _ = chunks((cut / "signals.mcap").read_bytes())[3]
    overwrite(cut / "signals.mcap", begin + 200, bytes(8))
    info = seal_session(cut)
    assert info.state == "sealed"
    assert "CRC of the chunk" in info.problems[0]
    with scan(cut / "signals.mcap") as found:
        assert found.sealed
        assert found.faults == []


def test_an_export_of_a_recovered_session_tells_the_loss_in_its_provenance(cut: Path, tmp_path: Path) -> None:
    begin, _ = chunks((cut / "signals.mcap").read_bytes())[3]
    overwrite(cut / "signals.mcap", begin + 200, bytes(8))
    rows = export_tables(cut, "csv", tmp_path / "tables", silent).rows
    assert rows["force"] == 54
    assert "force 6" in json.loads((cut / "session.json").read_text())["problems"][1]


@pytest.mark.parametrize("verb", ["export", "replay", "recover"])
def test_a_rosbag2_folder_is_named_as_one(
    tmp_path: Path, verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  version: 9\n")
    (bag / "bag.mcap").write_bytes(b"\x89MCAP0\r\n")
    more = ["--output", str(tmp_path / "out")] if verb == "export" else []
    for place in (bag, bag / "bag.mcap"):
        assert main([verb, str(place), *more]) == 2
        told = capsys.readouterr().err
        assert len(told.splitlines()) == 1
        assert "rosbag2" in told
        assert "only sessions that this software recorded are read" in told
    assert sorted(path.name for path in bag.iterdir()) == ["bag.mcap", "metadata.yaml"]
