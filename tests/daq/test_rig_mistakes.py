"""Every kind of mistake in a rig file is told with its line, and with what is allowed there."""

from pathlib import Path

import pytest

from daq.errors import RigError
from daq.rig import read_rig, write_rig
from daq.virtual_rig.layout import Addresses, rig_description

ADDRESSES = Addresses(1, 2, 3, 4, 5, 6, ("tcp://127.0.0.1:7", "tcp://127.0.0.1:8"))


@pytest.fixture
def rig_path(tmp_path: Path) -> Path:
    write_rig(rig_description(ADDRESSES, tmp_path / "stereo.toml"), tmp_path / "rig.toml")
    return tmp_path / "rig.toml"


def complaint_about(path: Path) -> str:
    with pytest.raises(RigError) as caught:
        read_rig(path)
    complaint = str(caught.value)
    assert "\n" not in complaint
    return complaint


def replaced(path: Path, old: str, new: str) -> int:
    """Replace one text in the file; return the number of its line."""
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    return text[: text.index(old)].count("\n") + 1


def without_tool(path: Path) -> None:
    """Take the table of the tool out."""
    text = path.read_text()
    begin = text.index("[tool]")
    path.write_text(text[:begin] + text[text.index("\n[", begin) + 1 :])


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        # the wrong type, where each type is wanted
        ("force_n = 15.0", "force_n = true", "limits.force_n must be of type float, not True"),
        ("rdt_port = 1\n", "rdt_port = '1'\n", "force_sensor.settings.rdt_port must be of type int, not '1'"),
        (
            "rdt_port = 1\n",
            "rdt_port = true\n",
            "force_sensor.settings.rdt_port must be of type int, not True",
        ),
        ('phantom_id = "', 'phantom_id = 7 # "', "specimen.phantom_id must be of type str, not 7"),
        ("position_m = [0.45, 0.0, 0.2]", "position_m = 0.45", "position_m must be a list, not 0.45"),
        (
            "position_m = [0.45, 0.0, 0.2]",
            'position_m = [0.45, "0", 0.2]',
            "position_m.1 must be of type float",
        ),
        ("position_m = [0.45, 0.0, 0.2]", "position_m = [0.45, inf, 0.2]", "position_m.1 must be finite"),
        ("position_m = [0.45, 0.0, 0.2]", "position_m = [0.45]", "position_m must have 3 entries, not 1"),
        # a word that is none of those allowed
        ('mode = "real-time"', 'mode = "slow"', "must be one of 'real-time', 'buffered', not 'slow'"),
        ('driver = "irb140"', 'driver = "irb120"', "robot.driver must be one of 'irb140'"),
        ('format = "retraction-rig/1"', 'format = "rig"', 'format must be "retraction-rig/1"'),
        # a key that is not known
        (
            "force_n = 15.0",
            "torque = 1\nforce_n = 15.0",
            "limits.torque is no known key; allowed here: force_n",
        ),
        # a value that the rig or the driver refuses, by the key that the refusal names
        (
            "communication_age_s = ",
            "communication_age_s = -",
            "limits is refused: communication_age_s must be",
        ),
        (
            "silence_s = 1.0\n",
            "silence_s = 0.0\n",
            "force_sensor.settings is refused: force sensor silence_s 0.0",
        ),
    ],
)
def test_a_mistake_at_a_key_is_told_with_the_line_of_the_key(
    rig_path: Path, old: str, new: str, told: str
) -> None:
    line = replaced(rig_path, old, new)
    complaint = complaint_about(rig_path)
    assert told in complaint
    assert f"{rig_path}, line {line}: " in complaint


def test_a_missing_key_is_told_with_its_table_and_its_type(rig_path: Path) -> None:
    replaced(rig_path, "force_n = 15.0\n", "")
    header = rig_path.read_text().splitlines().index("[limits]") + 1
    assert f"line {header}: limits lacks the key force_n, of type float" in complaint_about(rig_path)


def test_a_missing_table_is_told(rig_path: Path) -> None:
    without_tool(rig_path)
    assert "the file lacks the key tool, a table" in complaint_about(rig_path)


def with_cameras(path: Path, *names: str) -> None:
    """Have further cameras."""
    with path.open("a") as file:
        for name in names:
            file.write(
                f'\n[[cameras]]\nname = "{name}"\ndriver = "opencv"\n[cameras.settings]\nsource = "0"\n'
            )


def test_a_fifth_camera_is_refused(rig_path: Path) -> None:
    with_cameras(rig_path, "third", "fourth", "fifth")
    assert "cameras are 5; a rig has one to 4" in complaint_about(rig_path)


def test_a_later_camera_may_not_bear_the_name_of_an_earlier_one(rig_path: Path) -> None:
    with_cameras(rig_path, "third", "third")
    assert "cameras.3.name must differ from an earlier camera's, 'third'" in complaint_about(rig_path)


def test_a_pair_of_cameras_needs_its_calibration(rig_path: Path) -> None:
    replaced(rig_path, 'stereo_calibration = "stereo.toml"\n', "")
    assert "lacks the key stereo_calibration, of the cameras 'left' and 'right'" in complaint_about(rig_path)


def test_one_camera_has_no_calibration_of_two(rig_path: Path) -> None:
    text = rig_path.read_text()
    begin = text.rindex("[[cameras]]")
    end = text.index("\n[", text.index("[cameras.settings]", begin)) + 1
    rig_path.write_text(text[:begin] + text[end:])
    assert "stereo_calibration is of two cameras, and the rig has one" in complaint_about(rig_path)


def test_a_list_where_a_table_belongs_is_refused_at_its_line(rig_path: Path) -> None:
    without_tool(rig_path)
    rig_path.write_text("tool = [1]\n" + rig_path.read_text())
    assert "line 1: tool must be a table, not [1]" in complaint_about(rig_path)


@pytest.mark.parametrize("spelling", ["limits.force_n = 'much'", '"limits"."force_n" = \'much\''])
def test_the_line_of_a_dotted_or_quoted_key_is_found(tmp_path: Path, spelling: str) -> None:
    path = tmp_path / "rig.toml"
    write_rig(rig_description(ADDRESSES, tmp_path / "stereo.toml"), path)
    text = path.read_text()
    begin, end = text.index("[limits]"), text.index("[limits.workspace]")
    keys = text[begin:end].splitlines()[1:]
    others = [f"limits.{key}" for key in keys if key and not key.startswith("force_n")]
    head = "\n".join([text.splitlines()[0], spelling, *others, *text.splitlines()[1:]])
    path.write_text(head.replace(text[begin:end], ""))
    assert f"{path}, line 2: limits.force_n must be of type float, not 'much'" in complaint_about(path)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "line 1: format must be"),
        (b"format = \n", "line 1"),
        (b"a = 1\na = 2\n", "line 2"),
        (b"[limits\n", "line 1"),
        (b"\xff\xfe", "byte 0 is no text in UTF-8"),
    ],
)
def test_what_is_no_toml_is_told_with_its_line_where_there_is_one(
    tmp_path: Path, content: bytes, told: str
) -> None:
    path = tmp_path / "rig.toml"
    path.write_bytes(content)
    assert told in complaint_about(path)


def test_a_folder_in_place_of_the_file_is_told(tmp_path: Path) -> None:
    assert "is a folder" in complaint_about(tmp_path)
