"""A controlling program for a test to kill or to freeze; its arguments are the rig file and the session folder."""

import sys
from dataclasses import replace
from pathlib import Path

from daq.acquisition.client import Acquisition
from daq.rig import read_rig
from daq.session.session import Label
from daq.trajectories import PULL, Dwell
from robot_drivers.protocols import Speed


def tell(text: str, done: int, total: int) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def main() -> None:
    slow = replace(
        PULL,
        steps=2,
        step_length=0.006,
        return_steps=0,
        speed=Speed(0.001, 0.25),
        dwell=Dwell(rest_s=0.3, settle_s=0.1, measure_s=0.3),
    )
    with Acquisition(read_rig(Path(sys.argv[1]))) as acquisition:
        tell(f"process {acquisition.process_id}", 0, 0)
        acquisition.record(slow.trajectory(), Path(sys.argv[2]), Label("killed"), tell)


if __name__ == "__main__":
    main()
