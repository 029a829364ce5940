"""Files of the laboratory that a user hands over, with their readers and verbs."""

from dataclasses import replace
from pathlib import Path

from daq.bad_input.damage.any_file import BINARY, TEXT
from daq.bad_input.damage.value import JSON, JSON_LINES, TABLE, TOML
from daq.bad_input.kind import Kind
from daq.bad_input.samples import laboratory
from daq.calibration.stored_views import find_views
from daq.calibration_files.in_force import calibrations_in_force
from daq.faults.campaign import read_results
from daq.investigation.journal import read_journal
from daq.investigation.loop import JOURNAL_FILE
from daq.plans import due_runs, journal_path, read_plan
from daq.rig import make_devices, read_rig
from daq.trajectories.own import read_table
from daq.vision.camera_model import StereoCalibration
from robot_drivers.cameras.opencv import OpenCVCamera
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings


def _read_plan(folder: Path) -> object:
    plan = folder / "plan.toml"
    return due_runs(read_plan(plan), journal_path(plan), folder)


def _apply_calibration(folder: Path) -> object:
    rig = replace(read_rig(folder / "rig.toml"), calibration=folder)
    return calibrations_in_force(rig, {}).apply(rig)


def _record_plan(given: Path, out: Path) -> list[str]:
    return ["record", str(given / "rig.toml"), "--plan", str(given / "plan.toml")]


def _play_images(folder: Path) -> object:
    camera = OpenCVCamera(OpenCVCameraSettings(source=str(folder / "image%02d.png"), fps=25.0))
    camera.connect()
    try:
        return camera.read(timeout_s=1.0)
    finally:
        camera.close()


def _faults(given: Path, out: Path) -> list[str]:
    return ["faults", "--seed", "1", "--runs", "1", "--out", str(given / "results.jsonl")]


KINDS: tuple[Kind, ...] = (
    Kind(
        "rig",
        laboratory.rig,
        {"rig.toml": (*TEXT, *TOML)},
        read=lambda folder: make_devices(read_rig(folder / "rig.toml")),
        command=lambda given, out: ["devices", str(given / "rig.toml")],
    ),
    Kind(
        "stereo calibration",
        laboratory.rig,
        {"stereo.toml": (*TEXT, *TOML)},
        read=lambda folder: StereoCalibration.load(folder / "stereo.toml"),
    ),
    Kind(
        "kept calibration",
        laboratory.calibration,
        {"force_*.toml": (*TEXT, *TOML), "time_*.toml": TOML},
        read=_apply_calibration,
    ),
    Kind(
        "views of the board",
        laboratory.views,
        {"left*.png": BINARY},
        read=lambda folder: list(find_views(folder).read()),
        command=lambda given, out: [
            "calibrate", "cameras", str(given / "rig.toml"), "--images", str(given), "--output", str(out / "kept")
        ],
        quick=True,
    ),
    Kind(
        "journal of an investigation",
        laboratory.investigation,
        {JOURNAL_FILE: (*TEXT, *JSON)},
        read=lambda folder: read_journal(folder / JOURNAL_FILE, "P07"),
    ),
    Kind(
        "plan",
        laboratory.plan,
        {"plan.toml": (*TEXT, *TOML)},
        read=_read_plan,
        command=_record_plan,
    ),
    Kind(
        "journal of a plan",
        laboratory.plan,
        {"plan.journal.json": (*TEXT, *JSON)},
        read=_read_plan,
        command=_record_plan,
    ),
    Kind(
        "trajectory table",
        laboratory.trajectory_table,
        {"table.csv": (*TEXT, *TABLE)},
        read=lambda folder: read_table(folder / "table.csv"),
        command=lambda given, out: [
            "record", str(given / "rig.toml"), "--trajectory", str(given / "table.csv"), "--output", str(out / "s")
        ],
    ),
    Kind(
        "results of faults",
        laboratory.fault_results,
        {"results.jsonl": (*TEXT, *JSON_LINES)},
        read=lambda folder: read_results(folder / "results.jsonl", seed=1),
        command=_faults,
    ),
    Kind(
        "images of a camera",
        laboratory.image_sequence,
        {"image00.png": BINARY, "image01.png": BINARY},
        read=_play_images,
    ),
)  # fmt: skip
