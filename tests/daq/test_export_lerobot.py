"""Sessions as a LeRobot dataset: as its format asks, with what was recorded, and opened by the library where it is."""

import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image
from synthetic_session import SyntheticSession

from daq.cli import main
from daq.export import export_lerobot
from daq.progress import silent
from daq.recording.folder import read_info, seal_session, write_info
from daq.recording.reader import Recording
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from robot_drivers.protocols import Pose

POSES = tuple(Pose((0.04 + way, 0.0, 0.0)) for way in (0.0, 0.003))
FPS = 4
INDICES = ("frame_index", "episode_index", "index", "task_index")
STATISTICS = ("min", "max", "mean", "std", "count", "q01", "q10", "q50", "q90", "q99")


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    made = []
    for seed, kind in enumerate(("pull", "relaxation")):
        folder = tmp_path_factory.mktemp("lerobot") / kind
        SyntheticSession(POSES, SpringPhantom(GRASP_CENTRE, placed_beads(3)), seed=seed).write(folder)
        write_info(folder, replace(read_info(folder), trajectory={"kind": kind}))
        seal_session(folder)
        made.append(folder)
    return made


@pytest.fixture(scope="module")
def dataset(sessions: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("lerobot") / "dataset"
    export_lerobot(sessions, target, FPS, silent)
    return target


def read_table(place: Path, **options: Any) -> Any:
    import pyarrow.parquet  # 36 MB, which every process that collects the tests would hold

    return pyarrow.parquet.read_table(place, **options)


def info(dataset: Path) -> dict:
    return json.loads((dataset / "meta" / "info.json").read_text(encoding="utf-8"))


def frames(dataset: Path, episode: int) -> dict[str, np.ndarray]:
    """The columns of an episode, found as a reader finds them: by its row and the paths that the dataset states."""
    row = read_table(dataset / "meta" / "episodes").to_pylist()[episode]
    path = info(dataset)["data_path"].format(
        chunk_index=row["data/chunk_index"], file_index=row["data/file_index"]
    )
    table = read_table(dataset / path, filters=[("episode_index", "=", episode)])
    assert len(table) == row["length"] == row["dataset_to_index"] - row["dataset_from_index"]
    return {name: np.array(table[name].to_pylist()) for name in table.column_names}


def test_the_description_is_as_the_format_asks(dataset: Path) -> None:
    told = info(dataset)
    episodes = read_table(dataset / "meta" / "episodes").to_pylist()
    assert told["codebase_version"] == "v3.0"
    assert told["fps"] == FPS
    assert told["data_path"] == "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
    assert told["splits"] == {"train": "0:2"}
    assert told["total_episodes"] == len(episodes) == 2
    assert told["total_frames"] == episodes[-1]["dataset_to_index"]
    tasks = read_table(dataset / "meta" / "tasks.parquet").to_pandas() if has_pandas() else None
    if tasks is not None:
        assert tasks.index.tolist() == ["pull, phantom P1", "relaxation, phantom P1"]
    assert [one["tasks"] for one in episodes] == [["pull, phantom P1"], ["relaxation, phantom P1"]]
    assert {"timestamp", *INDICES} <= told["features"].keys()
    stats = json.loads((dataset / "meta" / "stats.json").read_text(encoding="utf-8"))
    assert stats.keys() == told["features"].keys()
    for name, feature in told["features"].items():
        assert set(stats[name]) == set(STATISTICS)
        shape = (3, 1, 1) if feature["dtype"] == "image" else tuple(feature["shape"])
        assert np.array(stats[name]["mean"]).shape == shape
        assert all(f"stats/{name}/{one}" in episodes[0] for one in STATISTICS)


def has_pandas() -> bool:
    try:
        import pandas  # noqa: F401 - only whether it is there
    except ImportError:
        return False
    return True


def test_columns_have_the_types_and_lengths_that_the_description_states(dataset: Path) -> None:
    schema = read_table(dataset / "data" / "chunk-000" / "file-000.parquet").schema
    told = info(dataset)["features"]
    assert set(schema.names) == set(told)
    for name, feature in told.items():
        kind = schema.field(name).type
        if feature["dtype"] == "image":
            assert {kind.field(place).name for place in range(kind.num_fields)} == {"bytes", "path"}
        elif feature["shape"] == [1]:
            assert str(kind) == {"float32": "float", "int64": "int64"}[feature["dtype"]]
        else:
            assert (str(kind.value_type), kind.list_size) == ("float", feature["shape"][0])
            assert len(feature["names"]) == kind.list_size
    features = json.loads(schema.metadata[b"huggingface"])["info"]["features"]
    assert features["observation.images.left"] == {"_type": "Image"}


def test_frames_are_numbered_and_timed_within_their_episode_and_the_whole(dataset: Path) -> None:
    first, second = frames(dataset, 0), frames(dataset, 1)
    assert second["index"].tolist() == list(
        range(len(first["index"]), len(first["index"]) + len(second["index"]))
    )
    for place, one in enumerate((first, second)):
        count = len(one["index"])
        assert one["frame_index"].tolist() == list(range(count))
        np.testing.assert_array_equal(one["timestamp"], (np.arange(count) / FPS).astype(np.float32))
        assert set(one["task_index"].tolist()) == {place}
        np.testing.assert_array_equal(one["action"][:-1], one["observation.state"][1:])


def test_pose_and_wrench_are_what_was_recorded(dataset: Path, sessions: list[Path]) -> None:
    """At rest for a second, then 3 mm further on; the sensor's reading is not zeroed."""
    one = frames(dataset, 0)
    np.testing.assert_allclose(one["observation.state"][0], [0.04, 0, 0, 1, 0, 0, 0], atol=5e-5)
    np.testing.assert_allclose(one["observation.state"][-1, :3], [0.043, 0, 0], atol=5e-5)
    force = Recording(sessions[0]).force
    rest = force.wrench[force.host_time_ns < force.host_time_ns[0] + 400_000_000].mean(axis=0)
    np.testing.assert_allclose(one["observation.wrench"][0], rest, atol=4e-3)
    assert one["observation.joints"].shape[1] == Recording(sessions[0]).robot.joints.shape[1]


def test_images_are_kept_without_loss(dataset: Path, sessions: list[Path]) -> None:
    recorded = Recording(sessions[0]).images("left")
    found = frames(dataset, 0)["observation.images.left"]
    pixels = [np.array(Image.open(io.BytesIO(cell["bytes"]))) for cell in found]
    assert list(pixels[0].shape) == info(dataset)["features"]["observation.images.left"]["shape"]
    if recorded.pixel_format(0) == "mono8":
        known = [recorded.image(number) for number in range(len(recorded))]
        assert all(any(np.array_equal(one[..., 1], image) for image in known) for one in pixels)


def test_statistics_are_those_of_all_frames(dataset: Path) -> None:
    stats = json.loads((dataset / "meta" / "stats.json").read_text(encoding="utf-8"))
    wrench = np.concatenate([frames(dataset, place)["observation.wrench"] for place in (0, 1)])
    np.testing.assert_allclose(
        stats["observation.wrench"]["std"], wrench.std(axis=0, dtype=np.float64), rtol=1e-6
    )
    np.testing.assert_allclose(
        stats["observation.wrench"]["q90"], np.quantile(wrench, 0.9, axis=0), rtol=1e-6
    )
    assert stats["index"]["count"] == [len(wrench)]
    pixels = [
        np.array(Image.open(io.BytesIO(cell["bytes"])))
        for place in (0, 1)
        for cell in frames(dataset, place)["observation.images.left"]
    ]
    channels = np.moveaxis(np.stack(pixels), -1, 0).reshape(
        3, -1
    )  # in bytes: as numbers they fill a gigabyte
    left = {name: 255.0 * np.ravel(values) for name, values in stats["observation.images.left"].items()}
    for channel, values in enumerate(channels):
        np.testing.assert_allclose(left["mean"][channel], values.mean(), rtol=1e-9)
        np.testing.assert_allclose(left["std"][channel], values.std(), rtol=1e-9)
        np.testing.assert_allclose(left["q50"][channel], np.quantile(values, 0.5), atol=1.0)


@pytest.fixture(scope="module")
def filmed(sessions: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("lerobot") / "filmed"
    export_lerobot(sessions, target, FPS, silent, as_video=True)
    return target


def test_images_become_video_that_follows_the_frames(filmed: Path, dataset: Path) -> None:
    """Each episode begins where its row says, and each frame is the image of its row, but for what the codec loses."""
    told = info(filmed)
    feature = told["features"]["observation.images.left"]
    assert (feature["dtype"], feature["info"]["video.fps"]) == ("video", FPS)
    assert "observation.images.left" not in frames(filmed, 0)
    for episode, row in enumerate(read_table(filmed / "meta" / "episodes").to_pylist()):
        key = "videos/observation.images.left"
        place = told["video_path"].format(
            video_key="observation.images.left",
            chunk_index=row[f"{key}/chunk_index"],
            file_index=row[f"{key}/file_index"],
        )
        film = cv2.VideoCapture(str(filmed / place))
        assert film.get(cv2.CAP_PROP_FPS) == FPS
        shown = []
        while (read := film.read())[0]:
            shown.append(read[1])
        first = round(row[f"{key}/from_timestamp"] * FPS)
        assert row[f"{key}/to_timestamp"] * FPS == first + row["length"]
        kept = frames(dataset, episode)["observation.images.left"]
        assert len(kept) == row["length"]
        for number, cell in enumerate(kept):
            exact = np.array(Image.open(io.BytesIO(cell["bytes"])))[..., ::-1]
            assert cv2.PSNR(shown[first + number], np.ascontiguousarray(exact)) > 30
    assert len(shown) == told["total_frames"]
    size = sum(file.stat().st_size for file in filmed.rglob("*") if file.is_file())
    assert size < 0.05 * sum(file.stat().st_size for file in dataset.rglob("*") if file.is_file())


def test_the_library_opens_it(dataset: Path) -> None:
    lerobot = pytest.importorskip("lerobot.datasets.lerobot_dataset")
    opened = lerobot.LeRobotDataset("laboratory/retractions", root=dataset)
    assert (opened.num_episodes, len(opened), opened.fps) == (2, info(dataset)["total_frames"], FPS)
    sample = opened[len(opened) - 1]
    assert sample["task"] == "relaxation, phantom P1"
    np.testing.assert_array_equal(sample["observation.wrench"], frames(dataset, 1)["observation.wrench"][-1])


def test_the_command_tells_what_was_written_and_takes_several_sessions(
    sessions: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    call = [
        "export",
        *map(str, sessions),
        "--format",
        "lerobot",
        "--output",
        str(tmp_path / "dataset"),
        "--json",
    ]
    assert main(call) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["fps"] == 2  # that of its cameras
    assert list(told["frames"]) == [str(session) for session in sessions]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--format", "csv"], "takes one session"),
        (["--format", "ros2", "--fps", "10"], "--fps is of --format lerobot"),
        (["--format", "csv", "--video"], "--video is of --format lerobot"),
        (["--format", "lerobot", "--licence", "CC0-1.0"], "--licence is of --format ro-crate"),
        (["--format", "lerobot", "--fps", "0"], "--fps 0: write a whole number"),
        (["--format", "lerobot", "--fps", "-3"], "--fps -3: write a whole number"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    options: list[str], told: str, sessions: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", *map(str, sessions), *options, "--output", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert told in said
    assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_sessions_that_differ_are_not_mixed(
    sessions: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    class Blind(SyntheticSession):
        def _write_images(self, log: object) -> None:
            return

    Blind(POSES, SpringPhantom(GRASP_CENTRE, placed_beads(3))).write(tmp_path / "blind")
    seal_session(tmp_path / "blind")
    call = ["export", str(sessions[0]), str(tmp_path / "blind"), "--format", "lerobot", "--output"]
    assert main([*call, str(tmp_path / "out")]) == 2
    assert "has other cameras, images or joints than" in capsys.readouterr().err
