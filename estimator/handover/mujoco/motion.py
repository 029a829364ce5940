"""The gripper's motion as a table: what the mocap body is to follow."""

import csv
from pathlib import Path

from estimator.handover.model import Run


def write_motion(run: Run, path: Path) -> Path:
    """Write time (s), position (m) and quaternion (scalar first) of every row."""
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["time", "px", "py", "pz", "qw", "qx", "qy", "qz"])
        for time, step in zip(run.experiment.time, run.of_row, strict=True):
            pose = run.poses[step]
            numbers = [time, *pose.position, *pose.rotation.as_quat(scalar_first=True)]
            table.writerow([f"{number:.9g}" for number in numbers])
    return path
