import csv
import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from synthetic_session import SyntheticSession

from daq.cli import main
from daq.export import export_experiment, export_tables
from daq.progress import silent
from daq.recording.folder import seal_session
from daq.recording.mcap import schemas
from daq.recording.mcap.log import McapLog
from daq.recording.reader import Recording
from daq.virtual_rig.layout import GRASP_CENTRE, placed_beads
from daq.virtual_rig.physics.phantom import SpringPhantom
from estimator.errors import InputError
from robot_drivers.protocols import Pose

POSES = tuple(Pose((0.04 + way, 0.0, 0.0)) for way in (0.0, 0.003))


class Unmeasured(SyntheticSession):
    """A session that ended before its first measuring window."""

    def _write_events(self, log: McapLog) -> None:
        log.add_channel("/events", schemas.EVENT)


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export") / "session"
    SyntheticSession(POSES, SpringPhantom(GRASP_CENTRE, placed_beads(3))).write(folder)
    seal_session(folder)
    return folder


def test_csv_holds_every_sample_with_its_unit_in_the_header(session: Path, tmp_path: Path) -> None:
    exported = export_tables(session, "csv", tmp_path / "csv", silent)
    force = Recording(session).force
    with (tmp_path / "csv" / "force.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(force) == exported.rows["force"]
    assert [float(row["fx (N)"]) for row in rows] == force.wrench[:, 0].tolist()
    assert float(rows[7]["device_time (s)"]) == force.device_time_s[7]
    assert set(exported.rows) == {"force", "robot", "camera_left", "camera_right", "events", "synchronised"}
    assert exported.unsynchronised == ""


def test_parquet_columns_carry_their_units(session: Path, tmp_path: Path) -> None:
    export_tables(session, "parquet", tmp_path / "parquet", silent)
    import pyarrow.parquet

    table = pyarrow.parquet.read_table(tmp_path / "parquet" / "robot.parquet")
    assert table.schema.field("joint_3").metadata[b"units"] == b"rad"
    np.testing.assert_array_equal(table["px"].to_numpy(), Recording(session).robot.position[:, 0])


def test_hdf5_groups_and_npz_arrays_hold_the_same(session: Path, tmp_path: Path) -> None:
    export_tables(session, "hdf5", tmp_path / "s.h5", silent)
    export_tables(session, "npz", tmp_path / "s.npz", silent)
    with h5py.File(str(tmp_path / "s.h5")) as store, np.load(tmp_path / "s.npz") as arrays:
        assert store["force/tx"].attrs["units"] == "N m"
        for table in ("force", "robot", "camera_left", "synchronised"):
            for name, dataset in store[table].items():
                if dataset.dtype.kind == "f":
                    np.testing.assert_array_equal(dataset[:], arrays[f"{table}/{name}"])
        assert [phase.decode() for phase in store["synchronised/phase"]] == ["hold", "hold"]
        assert arrays["synchronised/units"][0] == "s"


def test_the_synchronised_table_is_the_experiment(session: Path, tmp_path: Path) -> None:
    experiment, provenance = export_experiment(session, tmp_path / "experiment", silent)
    export_tables(session, "npz", tmp_path / "s.npz", silent)
    with np.load(tmp_path / "s.npz") as arrays:
        np.testing.assert_array_equal(arrays["synchronised/fx"], experiment.wrench[:, 0])
        np.testing.assert_array_equal(arrays["synchronised/m05z"], experiment.fiducials[:, 5, 2])
    assert experiment.path == tmp_path / "experiment"
    assert sum(rejection.count for rejection in provenance.rejected) >= 0
    assert "[[provenance.streams]]" in (tmp_path / "experiment" / "experiment.toml").read_text()


def test_estimated_times_follow_the_drifting_clock(session: Path, tmp_path: Path) -> None:
    export_tables(session, "npz", tmp_path / "s.npz", silent)
    with np.load(tmp_path / "s.npz") as arrays:
        late = arrays["force/host_time"] - arrays["force/time"]
        assert late.min() > -1e-6
        assert np.abs(np.diff(arrays["force/time"]) - 1e-3).max() < 1e-5


def test_what_exists_is_not_overwritten_and_nothing_is_left_half_written(
    session: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "s.h5").write_text("mine")
    with pytest.raises(InputError, match="exists already"):
        export_tables(session, "hdf5", tmp_path / "s.h5", silent)
    assert (tmp_path / "s.h5").read_text() == "mine"

    def full_disk(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("daq.export.table_formats.csv.writer", full_disk)
    with pytest.raises(OSError, match="No space"):
        export_tables(session, "csv", tmp_path / "csv", silent)
    assert [path.name for path in tmp_path.iterdir()] == ["s.h5"]


def test_a_session_without_a_window_gives_its_streams_and_says_what_lacks(tmp_path: Path) -> None:
    folder = tmp_path / "session"
    Unmeasured(POSES, SpringPhantom(GRASP_CENTRE, placed_beads(3)), frame_rate=1.0).write(folder)
    seal_session(folder)
    exported = export_tables(folder, "csv", tmp_path / "csv", silent)
    assert "no complete window at rest" in exported.unsynchronised
    assert exported.rows["events"] == 0
    assert exported.rows["force"] == 3000
    assert "synchronised" not in exported.rows


def test_the_command_line_tells_the_rows(
    session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["export", str(session), "--format", "parquet", "--output", str(tmp_path / "p"), "--json"]
    assert main(arguments) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["rows"]["synchronised"] == 2
    assert main(arguments) == 2
    assert "exists already" in capsys.readouterr().err
