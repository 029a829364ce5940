"""What the campaign of broken inputs has found, and stays found."""

import json
import os
import socket
import sys
import zlib
from pathlib import Path

import pytest

from daq.bad_input.samples import benchmarks, experiments, laboratory, sessions, surfaces
from daq.calibration_files.in_force import calibrations_in_force
from daq.errors import RecordingError, RigError, TrajectoryError
from daq.files.png import is_whole_png
from daq.plans import due_runs, journal_path, read_plan
from daq.recording.folder import read_info, verify_checksums
from daq.recording.recovery import recover_session
from daq.rig import read_rig
from daq.session_report import read_report
from daq.trajectories.own import load_function
from estimator.blind.scoring.diagnoses import read_diagnoses
from estimator.blind.scoring.keys import open_keys
from estimator.blind.sealing.openings import OPENINGS_FILE
from estimator.errors import InputError
from estimator.experiment import read_experiment
from estimator.surfaces.reading import read_surface
from robot_drivers.cameras.opencv import OpenCVCamera
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings
from robot_drivers.errors import DeviceError


def edited(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")


@pytest.mark.parametrize("number", ["1" + "0" * 400, "9" * 5000, "1e308"])
def test_a_number_beyond_all_quantities_is_refused(tmp_path: Path, number: str) -> None:
    laboratory.rig(tmp_path)
    edited(tmp_path / "rig.toml", "mass_kg = 0.35", f"mass_kg = {number}")
    with pytest.raises(RigError):
        read_rig(tmp_path / "rig.toml")
    experiments.experiment(tmp_path)
    edited(tmp_path / "pull" / "experiment.toml", "density = ", f"density = {number} # ")
    with pytest.raises(InputError):
        read_experiment(tmp_path / "pull")


@pytest.mark.parametrize(
    "name", ["../P07", "/tmp/P07", "a/b", "a\\\\b", "..", "", "CON", "aux.txt", "x\\u0000y", "P07."]
)
def test_a_phantom_whose_name_would_lead_out_of_the_folder_of_sessions_is_refused(
    tmp_path: Path, name: str
) -> None:
    laboratory.rig(tmp_path)
    edited(tmp_path / "rig.toml", 'phantom_id = "virtual"', f'phantom_id = "{name}"')
    with pytest.raises(RigError, match=r"rig\.toml, line \d+: specimen is refused: phantom_id"):
        read_rig(tmp_path / "rig.toml")


@pytest.mark.parametrize(
    "template",
    [
        "../{date}",
        "{date.__class__}",
        "{trial:999999999d}",
        "{trial!r:>99}",
        "/tmp/{date}",
        "{nothing}",
        "nul",
    ],
)
def test_a_template_that_is_no_plain_name_is_refused(tmp_path: Path, template: str) -> None:
    laboratory.plan(tmp_path)
    edited(tmp_path / "plan.toml", "{date}_{phantom}_{trial:02d}_{repeat}", template)
    with pytest.raises(RigError, match="name"):
        read_plan(tmp_path / "plan.toml")


@pytest.mark.parametrize(
    "program", ["../mine.py:sway", "/elsewhere/mine.py:sway", "a/../../mine.py:sway", "C:/mine.py:sway"]
)
def test_a_plan_runs_no_program_outside_of_its_folder(tmp_path: Path, program: str) -> None:
    laboratory.plan(tmp_path)
    edited(tmp_path / "plan.toml", "mine.py:sway", program)
    with pytest.raises(RigError, match="outside of the plan's folder"):
        read_plan(tmp_path / "plan.toml")


def test_no_program_of_a_plan_runs_where_the_plan_is_refused(tmp_path: Path) -> None:
    laboratory.plan(tmp_path)
    (tmp_path / "mine.py").write_text("from pathlib import Path\nPath(__file__).with_name('ran').touch()\n")
    edited(tmp_path / "plan.toml", "first_order = 1", "first_order = 'one'")
    with pytest.raises(RigError):
        read_plan(tmp_path / "plan.toml")
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("count", ["100000000000", "99999999"])
def test_a_plan_of_sessions_without_end_is_refused(tmp_path: Path, count: str) -> None:
    laboratory.plan(tmp_path)
    edited(tmp_path / "plan.toml", "repeat = 2", f"repeat = {count}")
    with pytest.raises(RigError, match="at most"):
        read_plan(tmp_path / "plan.toml")


@pytest.mark.parametrize(
    "source",
    ["def sway(way:", "raise SystemError('no')", "import nowhere_at_all", "sway = 3", "def sway(way): 1 / 0"],
)
def test_a_function_that_fails_is_told_in_one_line(tmp_path: Path, source: str) -> None:
    (tmp_path / "mine.py").write_text(source)
    with pytest.raises(TrajectoryError, match=r"mine\.py: "):
        load_function(tmp_path / "mine.py", "sway")


@pytest.mark.parametrize("text", ["", "[]", '{"a": 1}', '{"a": "b", "a": "c"}', "\\xff", "[" * 100_000])
def test_a_damaged_journal_is_refused_before_anything_is_recorded(tmp_path: Path, text: str) -> None:
    laboratory.plan(tmp_path)
    journal_path(tmp_path / "plan.toml").write_text(text)
    with pytest.raises(TrajectoryError, match=r"plan\.journal\.json"):
        due_runs(read_plan(tmp_path / "plan.toml"), journal_path(tmp_path / "plan.toml"), tmp_path)


def test_a_latency_of_an_unknown_stream_is_refused(tmp_path: Path) -> None:
    laboratory.calibration(tmp_path)
    edited(next(tmp_path.glob("time_*.toml")), '"force sensor"', '"wind"')
    with pytest.raises(RigError, match="stream must be one of"):
        calibrations_in_force(_with_calibrations(tmp_path), {})


def _with_calibrations(folder: Path):
    edited(folder / "rig.toml", 'name = "virtual rig"', 'name = "virtual rig"\ncalibration = "."')
    return read_rig(folder / "rig.toml")


def test_nothing_is_sealed_where_one_of_the_recordings_cannot_be(tmp_path: Path) -> None:
    sessions.cut_session(tmp_path)
    session = tmp_path / "session"
    (session / "cameras.mcap").write_bytes(b"no recording at all")
    before = (session / "signals.mcap").read_bytes()
    with pytest.raises(RecordingError, match=r"cameras\.mcap"):
        recover_session(session)
    assert (session / "signals.mcap").read_bytes() == before
    assert read_info(session).state == "recording"


@pytest.mark.parametrize(
    "line", ["0000  ../rig.toml", "0000  /dev/zero", "no line of it", "0000  signals.mcap"]
)
def test_a_list_of_checksums_leads_nowhere_but_into_its_session(tmp_path: Path, line: str) -> None:
    sessions.sealed_session(tmp_path)
    (tmp_path / "session" / "CHECKSUMS.sha256").write_text(f"{line}\n")
    altered = [line.partition("  ")[2]]
    assert verify_checksums(tmp_path / "session") == ["CHECKSUMS.sha256", *altered]


def test_a_file_larger_than_any_of_a_session_counts_as_altered_and_is_not_read(tmp_path: Path) -> None:
    sessions.sealed_session(tmp_path)
    with (tmp_path / "session" / "rig.toml").open("r+b") as file:
        file.truncate(1_000_000_000_000)
    assert verify_checksums(tmp_path / "session") == ["rig.toml"]


@pytest.mark.parametrize("text", ["[]", "{", '{"streams": {}}', "null", "[" * 100_000])
def test_a_report_of_a_recording_that_is_none_is_refused(tmp_path: Path, text: str) -> None:
    sessions.reported_session(tmp_path)
    session = tmp_path / "session"
    assert read_report(session).streams
    (session / "derived" / "report.json").write_text(text)
    with pytest.raises(RecordingError, match=r"report\.json: .*make the report anew"):
        read_report(session)


@pytest.mark.skipif(sys.platform == "win32", reason="no such pipes")
@pytest.mark.parametrize("source", ["image%02d.png", "image01.png"])
def test_a_pipe_in_the_place_of_an_image_is_not_waited_for(tmp_path: Path, source: str) -> None:
    laboratory.image_sequence(tmp_path)
    (tmp_path / "image01.png").unlink()
    os.mkfifo(tmp_path / "image01.png")
    with pytest.raises(DeviceError, match=r"image01\.png is a pipe"):
        OpenCVCamera(OpenCVCameraSettings(source=str(tmp_path / source), fps=25.0)).connect()


@pytest.mark.parametrize("name", ["film.avi", "film.m3u8", "film.mp4"])
def test_a_film_that_is_a_list_of_addresses_connects_to_none_of_them(tmp_path: Path, name: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0.0)
        address = f"http://127.0.0.1:{server.getsockname()[1]}/0.ts"
        film = tmp_path / name
        film.write_text(f"#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\n{address}\n#EXT-X-ENDLIST\n")
        with pytest.raises(DeviceError):
            OpenCVCamera(OpenCVCameraSettings(source=str(film))).connect()
        with pytest.raises(BlockingIOError):
            server.accept()


def test_an_image_of_a_sequence_that_cannot_be_decoded_is_told_by_the_driver_alone(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    laboratory.image_sequence(tmp_path)
    (tmp_path / "image00.png").write_bytes(b"no image")
    camera = OpenCVCamera(OpenCVCameraSettings(source=str(tmp_path / "image%02d.png"), fps=25.0))
    with pytest.raises(DeviceError, match=r"cannot be decoded|cannot open it"):
        camera.connect()
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    "key, value", [("order", "one"), ("problems", [3]), ("state", "new"), ("samples", {"/force": "x"})]
)
def test_a_session_description_of_other_types_is_refused(tmp_path: Path, key: str, value: object) -> None:
    sessions.sealed_session(tmp_path)
    file = tmp_path / "session" / "session.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), key: value}))
    with pytest.raises(RecordingError, match=r"session\.json"):
        read_info(tmp_path / "session")


def test_an_answer_of_other_types_is_refused(tmp_path: Path) -> None:
    benchmarks.benchmark(tmp_path)
    edited(tmp_path / "answers" / "one.json", '"closure_held_out": 0.8', '"closure_held_out": "much"')
    with pytest.raises(InputError, match=r"one\.json: is no diagnosis"):
        read_diagnoses(tmp_path / "answers")


@pytest.mark.parametrize(
    "old, new",
    [
        ('"gripper_slip": 0.9,', '"gripper_slip": 9.0,'),
        ('"gripper_slip": 0.9,\n  "none": 0.1', ""),
    ],
)
def test_an_answer_whose_probabilities_are_none_is_refused(tmp_path: Path, old: str, new: str) -> None:
    benchmarks.benchmark(tmp_path)
    edited(tmp_path / "answers" / "one.json", old, new)
    with pytest.raises(InputError, match=r"one\.json: is no diagnosis"):
        read_diagnoses(tmp_path / "answers")


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ('level = "clear"', "level = 3", "level is no word"),
        ('level = "clear"', 'level = ["clear", true]', "level is no word"),
        ("youngs_modulus = 15000.0", "youngs_modulus = 0", "positive"),
        ("[where]\ncentre = [0.01, 0.02, 0.0]\nradius = 0.01", "where = 3", "where is no table"),
    ],
)
def test_a_key_that_states_no_truth_is_refused(tmp_path: Path, old: str, new: str, complaint: str) -> None:
    benchmarks.benchmark(tmp_path)
    edited(tmp_path / "keys" / "two.toml", old, new)
    with pytest.raises(InputError, match=rf"two\.toml: .*{complaint}"):
        open_keys(tmp_path / "keys", "nobody")


@pytest.mark.parametrize("content", [b"\xff\xfe", bytes(9)])
def test_a_list_of_openings_that_is_none_is_neither_counted_nor_continued(
    tmp_path: Path, content: bytes
) -> None:
    benchmarks.benchmark(tmp_path)
    file = tmp_path / "keys" / OPENINGS_FILE
    file.write_bytes(content)
    with pytest.raises(InputError, match=r"openings\.txt"):
        open_keys(tmp_path / "keys", "a test")
    assert file.read_bytes() == content


def test_an_opening_is_counted_where_the_end_of_the_last_line_is_missing(tmp_path: Path) -> None:
    benchmarks.benchmark(tmp_path)
    (tmp_path / "keys" / OPENINGS_FILE).write_text("a first one", encoding="utf-8")
    assert [open_keys(tmp_path / "keys", "a test")[1].count for _ in range(2)] == [2, 3]


ENTITIES = '<!DOCTYPE VTKFile [<!ENTITY a "1 1 1 1"><!ENTITY b "&a;&a;&a;&a;">]>'
OUTSIDE = '<!DOCTYPE VTKFile [<!ENTITY b SYSTEM "file:///etc/hostname">]>'


@pytest.mark.parametrize("declaration", [ENTITIES, OUTSIDE], ids=["growing", "external"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_vtp_file_declares_no_entities(tmp_path: Path, declaration: str, encoding: str) -> None:
    surfaces.vtp(tmp_path)
    file = tmp_path / "body.vtp"
    text = file.read_text().replace("\n", declaration, 1).replace("</DataArray>", "&b;</DataArray>", 1)
    file.write_bytes(text.encode(encoding))
    with pytest.raises(InputError, match="document type"):
        read_surface(file)


def test_a_vtp_file_whose_numbers_exceed_their_type_is_refused(tmp_path: Path) -> None:
    surfaces.vtp(tmp_path)
    edited(tmp_path / "body.vtp", 'type="Int64" Name="offsets"', 'type="Int8" Name="offsets"')
    with pytest.raises(InputError, match=r"body\.vtp: cannot be read as VTP"):
        read_surface(tmp_path / "body.vtp")


@pytest.mark.parametrize("count", ["1000000000000", "-1"])
def test_a_count_that_lies_takes_no_memory(tmp_path: Path, count: str) -> None:
    surfaces.ply(tmp_path)
    file = tmp_path / "body.ply"
    content = file.read_bytes()
    file.write_bytes(content.replace(b"element vertex 42", b"element vertex " + count.encode(), 1))
    assert file.read_bytes() != content
    with pytest.raises(InputError, match=r"body\.ply"):
        read_surface(file)


def test_a_png_is_whole_with_every_chunk_and_checksum() -> None:
    header = (8).to_bytes(4, "big") + (6).to_bytes(4, "big") + b"\x08\x00\x00\x00\x00"
    chunks = {b"IHDR": header, b"IDAT": zlib.compress(bytes(54)), b"IEND": b""}
    pieces = [
        len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")
        for kind, data in chunks.items()
    ]
    whole = b"\x89PNG\r\n\x1a\n" + b"".join(pieces)
    assert is_whole_png(whole)
    assert not is_whole_png(whole[:-1])
    assert not is_whole_png(whole.replace(b"IDAT", b"IDAX"))
    assert not is_whole_png(whole.replace((8).to_bytes(4, "big") + (6).to_bytes(4, "big"), b"\x7f" * 8))
