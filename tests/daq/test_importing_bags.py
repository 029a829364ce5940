"""Recordings of other programs, written by libraries that are not ours: what each holds, and when it was."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from bag_files import (
    BAGS,
    BEGIN_NS,
    Message,
    camera_info,
    cloud,
    image,
    joints,
    markers,
    messages_of,
    plain_pose,
    pose,
    transform,
    transforms,
    trial,
    wrench,
    write_bag,
    write_mcap,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from daq.bags.reading import read_bag
from daq.cli import main
from estimator.experiment import read_experiment
from estimator.importing import import_experiment
from estimator.importing.applying import experiment_of
from estimator.importing.mapping import read_mapping
from estimator.importing.table import Source, Table

ONE_TRIAL = trial()
IN_ORDER = sorted(messages_of(ONE_TRIAL), key=lambda message: message[1])


def table(source: Source, name: str) -> Table:
    return next(one for one in source.tables if one.name == name)


def column(source: Source, name: str, column: str) -> np.ndarray:
    return next(one.values for one in table(source, name).columns if one.name == column)


def vectors(source: Source, name: str, prefix: str) -> np.ndarray:
    return np.stack([column(source, name, f"{prefix}{axis}") for axis in "xyz"], axis=1)


def stamps(source: Source, name: str, stamp: str = "header stamp") -> list[int]:
    """Stamps as the bag has them, ns of unix time."""
    begin, _, fraction = table(source, name).facts["time 0"].split(" ")[0].partition(".")
    since = np.rint(column(source, name, stamp) * 1e9).astype(np.int64)
    return (int(begin) * 10**9 + int(fraction) + since).tolist()


def written(folder: Path, messages: Sequence[Message], kind: str) -> Path:
    if kind == "plain MCAP":
        return write_mcap(folder / "plain.mcap", messages)
    return write_bag(folder / "bag", messages, kind)


KINDS = (*BAGS, "plain MCAP")


@pytest.mark.parametrize("kind", KINDS)
def test_every_storage_gives_the_same_values_and_stamps_to_the_nanosecond(kind: str, tmp_path: Path) -> None:
    source = read_bag(written(tmp_path, IN_ORDER, kind))
    assert source.remarks == ()
    assert [one.name for one in source.tables] == ["/arm/tool_pose", "/beads", "/ft/wrench"]
    assert stamps(source, "/arm/tool_pose") == ONE_TRIAL.time_ns.tolist()
    assert stamps(source, "/arm/tool_pose", "log time") == (ONE_TRIAL.time_ns + 700_000).tolist()
    np.testing.assert_array_equal(vectors(source, "/arm/tool_pose", "pose.position."), ONE_TRIAL.gripper)
    forces = [message for topic, _, message in IN_ORDER if topic == "/ft/wrench"]
    np.testing.assert_array_equal(
        column(source, "/ft/wrench", "wrench.force.x"), [one.wrench.force.x for one in forces]
    )
    for bead in range(ONE_TRIAL.beads.shape[1]):
        # a cloud has numbers of 32 bits
        np.testing.assert_allclose(
            vectors(source, "/beads", f"bead {bead}."), ONE_TRIAL.beads[:, bead], rtol=1e-6, atol=0
        )


@settings(max_examples=25, deadline=None)
@given(
    values=arrays(np.float64, (7, 6), elements=st.floats(-1e6, 1e6, allow_subnormal=False)),
    steps=st.lists(st.integers(1, 10**9), min_size=7, max_size=7),
    kind=st.sampled_from(["mcap", "sqlite3", "plain MCAP"]),
)
def test_any_values_at_any_times_come_back(
    values: np.ndarray, steps: list[int], kind: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    times = (BEGIN_NS + np.cumsum(steps)).tolist()
    messages = [("/ft", time, wrench(time, row)) for time, row in zip(times, values, strict=True)]
    source = read_bag(written(tmp_path_factory.mktemp("bag"), messages, kind))
    assert stamps(source, "/ft") == stamps(source, "/ft", "time") == times
    np.testing.assert_array_equal(vectors(source, "/ft", "wrench.torque."), values[:, 3:])


def test_a_bag_becomes_an_experiment_by_its_mapping(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_bag(tmp_path / "bag", IN_ORDER, "mcap, chunks compressed")
    call = ["import", str(bag), "--output", str(tmp_path / "pull")]
    assert main([*call, "--json"]) == 2
    asked = {one["key"] for one in json.loads(capsys.readouterr().out)["open"]}
    assert "[force] along" in asked  # the sensor's frame is not the robot's base
    assert "[force] is_of" not in asked  # the work of a force at another rate tells
    mapping = tmp_path / "pull.import.toml"
    lines = mapping.read_text(encoding="utf-8")
    answers = {
        "along": '"source"',
        "origin": "[0.0, 0.0, 0.0]",
        "shape": '"block"',
        "size": "[0.06, 0.03, 0.01]",
        "box": "[[0.018, -0.015, -0.005], [0.03, 0.015, 0.005]]",
        "surface_below": '"table"',
        "force_std": "0.01",
        "torque_std": "0.001",
        "fiducial_std": "5e-5",
    }
    for key, answer in answers.items():
        lines = lines.replace(f'{key} = "?"', f"{key} = {answer}", 1)
    mapping.write_text(lines.replace('box = "?"', 'box = "x-"'), encoding="utf-8")
    assert main(call) == 0, capsys.readouterr().out
    found = read_experiment(tmp_path / "pull")
    np.testing.assert_allclose(found.position, ONE_TRIAL.gripper, atol=1e-9)
    np.testing.assert_allclose(found.fiducials, ONE_TRIAL.beads, rtol=1e-6, atol=1e-9)
    known = np.isfinite(found.wrench[:, 0])
    assert known.sum() >= len(ONE_TRIAL.time_ns) - 1  # the last pose comes after the last force
    np.testing.assert_allclose(found.wrench[known, :3], ONE_TRIAL.force[known], atol=2e-3)
    np.testing.assert_allclose(found.time, (ONE_TRIAL.time_ns - ONE_TRIAL.time_ns[0]) / 1e9, atol=1e-9)


def test_a_sensor_that_turns_with_the_gripper_is_turned_back(tmp_path: Path) -> None:
    """The same load in the base all the time, read by a sensor that turns half around the vertical."""
    times = (BEGIN_NS + np.arange(40) * 25_000_000).tolist()
    turns = Rotation.from_euler("z", np.linspace(0, 180, 40)[:, None], degrees=True)
    load = np.array([1.0, 2.0, 3.0])
    messages: list[Message] = []
    for place, time in enumerate(times):
        position = (0.4 + 1e-4 * place, 0.0, 0.2)
        messages.append(("/tool_pose", time, pose(time, position, turns[place].as_quat())))
        read = turns[place].inv().apply(load)
        messages.append(("/ft", time, wrench(time, [*read, *(0.1 * read)])))
    bag = write_bag(tmp_path / "bag", messages)
    mapping = tmp_path / "turn.import.toml"
    for along, expected in (("gripper", True), ("source", False)):
        mapping.unlink(missing_ok=True)
        import_experiment(read_bag(bag), tmp_path / "turn")
        lines = mapping.read_text(encoding="utf-8")
        for key, answer in (*BODY, ("along", f'"{along}"'), ("is_of", '"tissue on gripper"')):
            lines = lines.replace(f'{key} = "?"', f"{key} = {answer}", 1)
        mapping.write_text(lines.replace('zero = "at rest"', 'zero = "as it is"'), encoding="utf-8")
        found = experiment_of(read_bag(bag), read_mapping(mapping), tmp_path)
        same = np.allclose(found.wrench, [*load, *(0.1 * load)], atol=1e-6)
        assert same is expected


BODY = (
    ("shape", '"block"'),
    ("size", "[0.06, 0.03, 0.01]"),
    ("box", '"x+ 0.012"'),
    ("box", '"x-"'),
    ("surface_below", '"table"'),
    ("force_std", "0.01"),
    ("torque_std", "0.001"),
)


@pytest.mark.parametrize("offset_s", [-5.0, 0.0, 3600.0])
def test_a_clock_that_runs_apart_is_mapped_to_that_of_the_recorder(offset_s: float, tmp_path: Path) -> None:
    """A sensor's own clock, 80 ppm fast, an hour off; its messages are received late, some of them very."""
    rng = np.random.default_rng(0)
    true_ns = BEGIN_NS + np.arange(3000) * 20_000_000
    stamp_ns = true_ns + ((true_ns - BEGIN_NS) * 80e-6).astype(np.int64) + int((offset_s + 0.2) * 1e9)
    log_ns = true_ns + 500_000 + (rng.exponential(2e6, len(true_ns))).astype(np.int64)
    messages = [
        ("/ft", int(log), wrench(int(stamp), [0.0] * 6))
        for log, stamp in sorted(zip(log_ns.tolist(), stamp_ns.tolist(), strict=True))
    ]
    source = read_bag(write_bag(tmp_path / "bag", messages))
    told = table(source, "/ft").facts["time"]
    assert "mapped to the recorder's clock" in told
    error = np.array(sorted(stamps(source, "/ft", "time"))) - true_ns
    # what no one-way method sees is the least delay
    np.testing.assert_allclose(error, 500_000, atol=100_000)
    assert sorted(stamps(source, "/ft")) == sorted(stamp_ns.tolist())


def test_stamps_of_the_recorders_own_clock_are_used_as_they_are(tmp_path: Path) -> None:
    """A camera's images come an exposure late; that is no reason to take its clock for another."""
    messages = [
        ("/pose", t + 35_000_000, pose(t, (0, 0, 0))) for t in (BEGIN_NS + np.arange(50) * 10**8).tolist()
    ]
    source = read_bag(write_bag(tmp_path / "bag", messages))
    assert "as it is" in table(source, "/pose").facts["time"]
    assert stamps(source, "/pose", "time") == stamps(source, "/pose")


def test_a_stream_without_stamps_has_the_time_of_its_receipt(tmp_path: Path) -> None:
    messages = [("/ft", BEGIN_NS + k * 10**7, wrench(0, [k] * 6)) for k in range(5)]
    source = read_bag(write_bag(tmp_path / "bag", messages))
    assert table(source, "/ft").facts["time"] == "log time (no header.stamp)"
    assert stamps(source, "/ft", "time") == [time for _, time, _ in messages]


def test_the_tool_is_where_the_chain_of_its_links_puts_it(tmp_path: Path) -> None:
    """Two links that move, told at different times, and a flange that does not."""
    times = BEGIN_NS + np.arange(40) * 25_000_000
    angles = np.linspace(0.0, 0.4, 40)
    turns = Rotation.from_euler("z", angles[:, None])
    messages: list[Message] = [
        ("/tf_static", BEGIN_NS, transforms(transform(BEGIN_NS, "link_2", "tool0", (0.1, 0, 0))))
    ]
    for place, time in enumerate(times.tolist()):
        messages.append(
            ("/tf", time, transforms(transform(time, "base", "link_1", (0, 0, 0.3), turns[place].as_quat())))
        )
        slid = time + 1_000_000
        messages.append(("/tf", slid, transforms(transform(slid, "link_1", "link_2", (0.001 * place, 0, 0)))))
    source = read_bag(write_bag(tmp_path / "bag", messages))
    name = "tf base to tool0"
    assert source.tables[0].name == name
    since = (
        column(source, name, "header stamp")
        + (int(stamps(source, name)[0]) - BEGIN_NS) / 1e9
        - column(source, name, "header stamp")[0]
    )
    angle = np.interp(since, (times - BEGIN_NS) / 1e9, angles)
    reach = 0.1 + np.interp(since, (times + 1_000_000 - BEGIN_NS) / 1e9, 0.001 * np.arange(40))
    expected = np.column_stack([reach * np.cos(angle), reach * np.sin(angle), np.full(len(angle), 0.3)])
    np.testing.assert_allclose(vectors(source, name, "position."), expected, rtol=1e-6, atol=1e-12)
    assert {"tf base to link_1", "tf link_1 to link_2"} <= {one.name for one in source.tables}


def test_joints_are_told_by_their_names_whatever_their_order(tmp_path: Path) -> None:
    messages = [
        ("/joint_states", BEGIN_NS, joints(BEGIN_NS, ["elbow_x", "wrist_y"], [1.0, 2.0])),
        ("/joint_states", BEGIN_NS + 1, joints(BEGIN_NS + 1, ["wrist_y", "elbow_x"], [3.0, 4.0])),
    ]
    source = read_bag(write_bag(tmp_path / "bag", messages))
    assert column(source, "/joint_states", "joint elbow_x angle").tolist() == [1.0, 4.0]
    assert column(source, "/joint_states", "joint wrist_y angle").tolist() == [2.0, 3.0]


@pytest.mark.parametrize("how", ["markers", "cloud with identities", "poses"])
def test_beads_keep_their_identity(how: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    points = rng.uniform(-0.02, 0.02, (6, 3, 3))
    messages: list[Message] = []
    for row, time in enumerate((BEGIN_NS + np.arange(6) * 10**8).tolist()):
        if how == "markers":
            message = markers(time, points[row])
        elif how == "poses":
            message = poses_of(time, points[row])
        else:
            order = rng.permutation(3)
            message = cloud(time, points[row][order], order.tolist())
        messages.append(("/beads", time, message))
    source = read_bag(write_bag(tmp_path / "bag", messages))
    prefix = "bead bead/" if how == "markers" else "bead "
    for bead in range(3):
        np.testing.assert_allclose(vectors(source, "/beads", f"{prefix}{bead}."), points[:, bead], rtol=1e-6)
    assert stamps(source, "/beads") == [time for _, time, _ in messages]


def poses_of(time_ns: int, points: np.ndarray) -> object:
    from bag_files import header, made

    return made(
        "geometry_msgs/PoseArray",
        header=header(time_ns, "base_link"),
        poses=[plain_pose(point) for point in points],
    )


def test_images_and_cameras_are_told_and_not_followed(tmp_path: Path) -> None:
    messages = [*IN_ORDER[:60]]
    for k in range(5):
        time = BEGIN_NS + 10**9 + k * 10**8
        messages += [("/cam/image_raw", time, image(time)), ("/cam/camera_info", time, camera_info(time))]
    remarks = read_bag(write_bag(tmp_path / "bag", messages)).remarks
    assert "/cam/image_raw: 5 images, 10.0 Hz, 6 x 4 mono8; points in images are not looked for" in remarks
    assert any(
        line.startswith("/cam/camera_info: fx 500.00, fy 510.00, cx 3.00, cy 2.00") for line in remarks
    )


def test_what_others_wrote_and_what_we_export_are_read_alike(tmp_path: Path) -> None:
    """Our own export is a bag as any other."""
    from daq.bad_input.samples.sessions import Extent, cut_session
    from daq.export import export_ros2
    from daq.progress import silent
    from daq.recording.reader import Recording

    cut_session(tmp_path, Extent(samples=200, samples_in_chunk=50, images=2))
    export_ros2(tmp_path / "session", tmp_path / "bag", silent)
    source = read_bag(tmp_path / "bag")
    recording = Recording(tmp_path / "session")
    anchor = recording.info.clock_anchor
    wall_ns = recording.force.host_time_ns - anchor.host_time_ns + anchor.wall_time_ns
    assert stamps(source, "/force/wrench") == wall_ns.tolist()
    np.testing.assert_array_equal(
        vectors(source, "/force/wrench", "wrench.force."), recording.force.wrench[:, :3]
    )
