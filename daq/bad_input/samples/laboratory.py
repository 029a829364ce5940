"""Files of the laboratory: rig and calibrations, plan, table, images, results of faults."""

import json
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np

from daq.calibration_files.outcome import Figure, Kind
from daq.calibration_files.record import FORMAT, CalibrationRecord, Serial
from daq.calibration_files.results import ForceResult, StreamLatency, TimeResult
from daq.faults.campaign import keep
from daq.faults.trial import Outcome as FaultOutcome
from daq.files.toml_tables import toml_text
from daq.investigation.journal import Entry, Journal, write_journal
from daq.investigation.loop import JOURNAL_FILE
from daq.investigation.manoeuvre import Manoeuvre, still
from daq.plans import journal_path
from daq.rig import write_rig
from daq.virtual_rig.layout import Addresses, rig_description
from daq.virtual_rig.rendering.scene import flea2_pair

_ADDRESSES = Addresses(1, 2, 3, 4, 5, 6, ("tcp://127.0.0.1:7", "tcp://127.0.0.1:8"))


def rig(folder: Path) -> None:
    """Write ``rig.toml`` with its stereo calibration."""
    flea2_pair().save(folder / "stereo.toml")
    write_rig(rig_description(_ADDRESSES, folder / "stereo.toml"), folder / "rig.toml")


def investigation(folder: Path) -> None:
    """Write the journal of an investigation of two manoeuvres, one refused."""
    pull, hold = Manoeuvre("pull", amplitude_m=0.006), Manoeuvre("hold", amplitude_m=0.01, holds_s=(2.0, 5.0))
    entries = [
        Entry(
            one, f"experiments/{number:02d}_{one.name}", 12.0, 0.5, "why", {"none": 0.8, "unknown": 0.2}, True
        )
        for number, one in enumerate((pull, hold), start=1)
    ]
    write_journal(Journal("P07", tuple(entries), (still(20.0),)), folder / JOURNAL_FILE)


def plan(folder: Path) -> None:
    """Write ``plan.toml`` and its journal, a table and a function that it names, and a rig."""
    rig(folder)
    trajectory_table(folder)
    (folder / "mine.py").write_text(
        "from robot_drivers.protocols import Pose\n\n\ndef sway(way):\n    return Pose((0.01 * way, 0.0, 0.0))\n",
        encoding="utf-8",
    )
    (folder / "plan.toml").write_text(
        'format = "retraction-plan/1"\nsessions = "sessions"\nname = "{date}_{phantom}_{trial:02d}_{repeat}"\n'
        'operator = "N. N."\nfirst_order = 1\n\n[[trials]]\ntrajectory = "pull"\nrepeat = 2\nsteps = 5\n'
        "step_length_m = 0.001\nrounds = 1\nholds_s = [3.0, 8.0]\nsettle_s = 0.5\n\n[[trials]]\n"
        'trajectory = "table.csv"\nspeed_m_s = 0.004\n\n[[trials]]\ntrajectory = "mine.py:sway"\n'
        'steps = 4\nnotes = "slow"\n',
        encoding="utf-8",
    )
    journal = {"0123456789ab.1": "sessions/one", "0123456789ab.2": "sessions/two"}
    journal_path(folder / "plan.toml").write_text(json.dumps(journal, indent=2), encoding="utf-8")


def trajectory_table(folder: Path) -> None:
    """Write ``table.csv`` and a rig."""
    rig(folder)
    rows = [f"{1e-3 * row},0.0,{1e-4 * row},0.0,0.0,{0.01 * row},0.5,0.8,hold" for row in range(1, 9)]
    header = "x_m,y_m,z_m,rx_rad,ry_rad,rz_rad,settle_s,measure_s,phase"
    (folder / "table.csv").write_text("\n".join([header, *rows, ""]), encoding="utf-8")


def calibration(folder: Path) -> None:
    """Write kept calibrations of a force sensor and of the streams' times, and a rig."""
    rig(folder)
    six = (0.1, 0.2, 0.3, 0.01, 0.02, 0.03)
    curve = ((-0.01, 0.0, 0.01), (0.2, 0.9, 0.3), (0.01, 0.01, 0.01))
    results: Mapping[Kind, object] = {
        "force": ForceResult(0.35, 0.001, (0.0, 0.0, 0.06), (1e-4, 1e-4, 1e-4), six, six, six),
        "time": TimeResult("sway", (StreamLatency("force sensor", 0.01, 1e-4, *curve),)),
    }
    for kind, result in results.items():
        record = CalibrationRecord(
            FORMAT,
            kind,
            "virtual rig",
            "2026-05-04T14:32:10+00:00",
            "2027-05-04T14:32:10+00:00",
            "accepted",
            (Serial("force_sensor", "FT12345"),),
            (Figure("rms", 0.02, "N", most=0.05),),
            result,
        )
        (folder / f"{kind}_2026-05-04_143210.toml").write_text(toml_text(record, folder), encoding="utf-8")


def fault_results(folder: Path) -> None:
    """Write ``results.jsonl``, the results of two runs of the fault campaign."""
    for run in range(2):
        keep(
            folder / "results.jsonl",
            FaultOutcome(
                fault="EGM falls silent",
                seed=1,
                run=run,
                instant_s=1.5,
                moved_for_s=0.02,
                way_m=0.004,
                acknowledged={"force": 100, "robot": 90},
                found={"force": 101, "robot": 91},
                told="the robot has fallen silent",
                state="sealed",
                problems=("the robot has fallen silent",),
                resets={"robot": 0},
                late_s={"robot": 0.002},
                next_failure="",
                load=1.0,
                seconds=9.0,
            ),
        )


def image_sequence(folder: Path) -> None:
    """Write three images that a camera of the driver ``opencv`` may play."""
    shades = np.arange(48 * 64, dtype=np.uint8).reshape(48, 64)
    for number in range(3):
        (folder / f"image{number:02d}.png").write_bytes(cv2.imencode(".png", shades)[1].tobytes())


def views(folder: Path) -> None:
    """Write two small pairs of images, in which there is no board, and a rig."""
    rig(folder)
    shades = np.arange(48 * 64, dtype=np.uint8).reshape(48, 64)
    for side in ("left", "right"):
        for number in range(2):
            (folder / f"{side}{number}.png").write_bytes(cv2.imencode(".png", shades)[1].tobytes())
