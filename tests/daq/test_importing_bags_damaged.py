"""Bags that are damaged, incomplete or odd: what can be read is read and told, anything else is one line."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bag_files import (
    BEGIN_NS,
    cloud,
    header,
    made,
    messages_of,
    pose,
    text,
    trial,
    wrench,
    write_bag,
    write_mcap,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer as PlainWriter

from daq.bags.reading import read_bag
from daq.cli import main
from daq.errors import DaqError
from estimator.errors import InputError

MESSAGES = sorted(messages_of(trial()), key=lambda message: message[1])
WRENCHES = sum(topic == "/ft/wrench" for topic, _, _ in MESSAGES)


def refusal(source: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """The one line with which the command refuses a source."""
    assert main(["import", str(source), "--output", str(source.with_name("out"))]) == 2
    told = capsys.readouterr().err
    assert told.startswith("retract: ")
    assert told.count("\n") == 1
    assert "Traceback" not in told
    return told


def rows(source: Path, name: str = "/ft/wrench") -> int:
    return next((table.rows for table in read_bag(source).tables if table.name == name), 0)


@pytest.mark.parametrize("kind", ["mcap", "mcap, chunks compressed", "sqlite3", "mcap, files compressed"])
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(share=st.floats(0.0, 1.0, exclude_max=True))
def test_a_bag_that_is_cut_off_anywhere_is_read_as_far_as_it_goes_or_refused(
    kind: str, share: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    bag = write_bag(tmp_path_factory.mktemp("cut") / "bag", MESSAGES, kind)
    file = next(one for one in bag.iterdir() if one.name != "metadata.yaml")
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    try:
        source = read_bag(bag)
    except (DaqError, InputError) as error:
        assert str(bag) in str(error)
    else:
        found = sum(table.rows for table in source.tables if table.name == "/ft/wrench")
        assert found == WRENCHES or any("missing" in line for line in source.remarks)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7])
def test_of_a_chunk_that_is_cut_off_the_whole_messages_are_read(share: float, tmp_path: Path) -> None:
    """As a computer leaves it that lost its power; the library writes one chunk, and numbers nothing."""
    bag = write_bag(tmp_path / "bag", MESSAGES)
    file = next(bag.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    source = read_bag(bag)
    found = rows(bag)
    assert 0 < found < WRENCHES
    assert f"/ft/wrench: {WRENCHES - found} of {WRENCHES} messages are missing" in source.remarks
    assert any("without a checksum" in line for line in source.remarks)
    forces = [message.wrench.force.x for topic, _, message in MESSAGES if topic == "/ft/wrench"]
    read = next(
        column.values
        for table in source.tables
        for column in table.columns
        if column.name == "wrench.force.x"
    )
    assert read.tolist() == forces[:found]


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_a_bag_in_which_any_bytes_are_others_is_read_or_refused(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    kind = data.draw(st.sampled_from(["mcap", "sqlite3"]))
    bag = write_bag(tmp_path_factory.mktemp("altered") / "bag", MESSAGES[:40], kind)
    file = data.draw(st.sampled_from(sorted(bag.iterdir())))
    content = bytearray(file.read_bytes())
    for place in data.draw(st.lists(st.integers(0, len(content) - 1), min_size=1, max_size=8)):
        content[place] = data.draw(st.integers(0, 255))
    file.write_bytes(content)
    try:
        read_bag(bag)
    except (DaqError, InputError) as error:
        assert str(bag) in str(error)


def test_without_its_description_the_files_are_read_in_their_order(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", MESSAGES)
    (bag / "metadata.yaml").unlink()
    source = read_bag(bag)
    assert source.remarks == (
        "metadata.yaml is missing or damaged; the files are read in the order of their names",
    )
    assert rows(bag) == WRENCHES


def test_messages_that_the_description_counts_and_that_are_not_there_are_told(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", MESSAGES)
    other = write_bag(tmp_path / "other", MESSAGES[:50])
    next(other.glob("*.mcap")).replace(next(bag.glob("*.mcap")))
    remarks = read_bag(bag).remarks
    left = sum(topic == "/ft/wrench" for topic, _, _ in MESSAGES[:50])
    assert f"/ft/wrench: {WRENCHES - left} of {WRENCHES} messages are missing" in remarks


def test_a_part_that_is_listed_and_not_there_is_told(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", MESSAGES)
    description = bag / "metadata.yaml"
    words = description.read_text(encoding="utf-8")
    description.write_text(words.replace("- bag.mcap", "- bag.mcap\n  - bag_1.mcap", 1), encoding="utf-8")
    assert "bag_1.mcap is listed and not there" in read_bag(bag).remarks


def test_an_empty_bag_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "holds no message" in refusal(write_bag(tmp_path / "bag", []), capsys)
    assert "holds no message" in refusal(write_mcap(tmp_path / "empty.mcap", []), capsys)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.mcap", b""),
        ("a.mcap", b"\x89MCAP0\r\n"),
        ("a.mcap", b"no recording at all"),
        ("a.db3", b"SQLite format 3\x00" + b"\x00" * 500),
        ("a.db3", b""),
        ("a.mcap.zstd", b"\x28\xb5\x2f\xfd" + b"\x01" * 40),
        ("a.bag", b"#ROSBAG V2.0\n" + b"\x00" * 40),
    ],
)
def test_a_file_that_is_no_recording_is_refused_in_one_line(
    name: str, content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_bytes(content)
    assert str(tmp_path) in refusal(tmp_path / name, capsys)


def test_a_session_is_not_imported_but_exported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "session").mkdir()
    (tmp_path / "session" / "session.json").write_text("{}")
    (tmp_path / "session" / "signals.mcap").write_bytes(b"")
    assert "`retract export` makes an experiment of it" in refusal(tmp_path / "session", capsys)


def test_topics_of_unknown_encoding_or_type_are_told_and_the_others_read(tmp_path: Path) -> None:
    file = tmp_path / "mixed.mcap"
    with file.open("wb") as stream:
        writer = PlainWriter(stream)
        writer.start()
        nothing = writer.register_channel("/json", "json", 0)
        unknown = writer.register_channel(
            "/load", "cdr", writer.register_schema("lab/msg/Load", "ros2msg", b"float64 N\n")
        )
        broken = writer.register_channel(
            "/broken", "cdr", writer.register_schema("lab/msg/Odd", "ros2msg", b"what is this?")
        )
        for k in range(3):
            writer.add_message(nothing, k, b"{}", k)
            writer.add_message(unknown, k, b"\0\1\0\0" + np.float64(k).tobytes(), k)
            writer.add_message(broken, k, b"\0\1\0\0", k)
        writer.finish()
    source = read_bag(file)
    # a type that the file defines need not be known beforehand
    assert [(table.name, table.columns[-1].name) for table in source.tables] == [("/load", "N")]
    assert source.tables[0].columns[-1].values.tolist() == [0.0, 1.0, 2.0]
    assert "/json: is encoded as json, not as CDR; left out" in source.remarks
    assert any(line.startswith("/broken: is of the type lab/msg/Odd") for line in source.remarks)


def test_a_recording_without_numbers_says_what_it_has(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_bag(tmp_path / "bag", [("/chatter", BEGIN_NS + k, text("hello")) for k in range(3)])
    told = refusal(bag, capsys)
    assert "no topic is a stream of forces, poses, joints or points" in told
    assert "/chatter (std_msgs/msg/String)" in told


def test_a_topic_that_a_mapping_names_and_that_is_absent_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_bag(tmp_path / "bag", MESSAGES)
    main(["import", str(bag), "--output", str(tmp_path / "first")])
    mapping = tmp_path / "first.import.toml"
    words = mapping.read_text(encoding="utf-8").replace('"?"', '"x-"')
    mapping.write_text(words, encoding="utf-8")
    capsys.readouterr()
    less = [message for message in MESSAGES if message[0] != "/ft/wrench"]
    other = write_bag(tmp_path / "less", less)
    call = ["import", str(other), "--output", str(tmp_path / "second"), "--mapping", str(mapping)]
    assert main(call) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1


def test_a_topic_of_two_types_is_two_streams(tmp_path: Path) -> None:
    file = tmp_path / "two.mcap"
    with file.open("wb") as stream:
        writer = PlainWriter(stream)
        writer.start()
        for name in ("N", "mN"):
            schema = writer.register_schema(f"lab/msg/{name}", "ros2msg", f"float64 {name}\n".encode())
            channel = writer.register_channel("/load", "cdr", schema)
            for k in range(3):
                writer.add_message(channel, k, b"\0\1\0\0" + np.float64(k).tobytes(), k)
        writer.finish()
    found = {table.name: table.columns[-1].name for table in read_bag(file).tables}
    assert sorted(found.values()) == ["N", "mN"]
    assert len(found) == 2


def test_the_description_stands_for_its_bag(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", MESSAGES)
    assert rows(bag / "metadata.yaml") == WRENCHES


def test_two_messages_of_one_stamp_are_one_row_and_counted(tmp_path: Path) -> None:
    messages = [
        ("/ft", BEGIN_NS + k // 2 * 10**7, wrench(BEGIN_NS + k // 2 * 10**7, [k] * 6)) for k in range(10)
    ]
    source = read_bag(write_bag(tmp_path / "bag", messages))
    assert rows(tmp_path / "bag", "/ft") == 5
    assert source.remarks == ("/ft: 5 of 10 messages have the time of another; left out",)


def test_stamps_that_go_back_give_ascending_times_by_the_recorders_clock(tmp_path: Path) -> None:
    """A driver that was started anew counts from zero again; one message was overtaken by the next."""
    messages = []
    for k in range(200):
        log = BEGIN_NS + k * 10**7
        stamp = 10**9 + (k if k < 100 else k - 100) * 10**7
        messages.append(("/ft", log, wrench(stamp, [float(k)] * 6)))
    source = read_bag(write_bag(tmp_path / "bag", messages))
    (one,) = source.tables
    assert "begun anew 1 times" in one.facts["time"]
    time, values = (
        next(c.values for c in one.columns if c.name == name) for name in ("time", "wrench.force.x")
    )
    assert np.all(np.diff(time) > 0)
    np.testing.assert_allclose(time - time[0], values * 1e-2, atol=2e-4)


def test_a_message_that_cannot_be_decoded_is_left_out_and_counted(tmp_path: Path) -> None:
    file = write_mcap(tmp_path / "a.mcap", [])
    with file.open("wb") as stream:
        writer = PlainWriter(stream)
        writer.start()
        definition = decoding_definition()
        channel = writer.register_channel(
            "/ft", "cdr", writer.register_schema("geometry_msgs/msg/WrenchStamped", "ros2msg", definition)
        )
        for k in range(6):
            body = serialised(wrench(BEGIN_NS + k, [k] * 6))
            writer.add_message(channel, BEGIN_NS + k, body if k != 3 else body[:40], BEGIN_NS + k)
        writer.finish()
    source = read_bag(file)
    assert source.tables[0].rows == 5
    assert source.remarks == ("/ft: 1 of 6 messages cannot be decoded; left out",)


def decoding_definition() -> bytes:
    from bag_files import STORE

    return STORE.generate_msgdef("geometry_msgs/msg/WrenchStamped", ros_version=2)[0].encode()


def serialised(message: object) -> bytes:
    from bag_files import STORE

    return bytes(STORE.serialize_cdr(message, "geometry_msgs/msg/WrenchStamped"))


@pytest.mark.parametrize(
    ("clouds", "why"),
    [
        (lambda time, k: cloud(time, np.zeros((3 + k % 2, 3))), "3 to 4 points without a field id"),
        (lambda time, k: cloud(time, np.zeros((3000, 3))), "3000 points a message: a surface"),
        (lambda time, k: cloud_without_z(time), "a cloud without x, y and z"),
    ],
)
def test_a_cloud_whose_points_cannot_be_followed_is_told(
    clouds: Callable[[int, int], object], why: str, tmp_path: Path
) -> None:
    times = (BEGIN_NS + np.arange(4) * 10**8).tolist()
    messages = [("/cloud", time, clouds(time, k)) for k, time in enumerate(times)]
    messages += [("/pose", time, pose(time, (0, 0, 0))) for time in times]
    remarks = read_bag(write_bag(tmp_path / "bag", messages)).remarks
    assert any(line.startswith("/cloud: ") and why in line for line in remarks)


def cloud_without_z(time_ns: int) -> object:
    field = made("sensor_msgs/PointField", name="x", offset=0, datatype=7, count=1)
    return made(
        "sensor_msgs/PointCloud2",
        header=header(time_ns),
        height=1,
        width=1,
        fields=[field],
        is_bigendian=False,
        point_step=4,
        row_step=4,
        data=np.zeros(4, np.uint8),
        is_dense=True,
    )


def test_without_the_library_the_command_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_bag(tmp_path / "bag", MESSAGES[:5])
    monkeypatch.setitem(sys.modules, "rosbags", None)
    assert "pip install 'retraction[ros2]'" in refusal(bag, capsys)
