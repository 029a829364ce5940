"""A rig of fake devices that a session runs on in a moment."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from fake_devices import FakeCamera, FakeForceSensor, FakeRobot

from daq.devices import Devices
from daq.progress import Progress, silent
from daq.rig import Rig
from daq.session.session import Label, run_session
from daq.trajectories import PULL, Dwell, Trajectory
from daq.virtual_rig.layout import REST_TOOL, Addresses, rig_description
from daq.virtual_rig.rendering.scene import flea2_pair

SHORT = replace(
    PULL, steps=3, return_steps=1, step_length=0.002, dwell=Dwell(rest_s=0.1, settle_s=0.02, measure_s=0.05)
)


class Bench:
    """Fake devices at rest, and a rig that describes them; generous speed limit, for the fakes jump."""

    def __init__(self, folder: Path) -> None:
        calibration = folder / "stereo.toml"
        flea2_pair().save(calibration)
        addresses = Addresses(1, 2, 3, 4, 5, 6, ("tcp://a:1", "tcp://b:2"))
        rig = rig_description(addresses, calibration)
        self.rig: Rig = replace(rig, limits=replace(rig.limits, speed_m_s=5.0, communication_age_s=30.0))
        self.force = FakeForceSensor()
        self.force.wrench[:] = 20.0, -7.0, 3.0, 0.5, 0.2, 0.1
        self.robot = FakeRobot(REST_TOOL)
        self.devices = Devices(self.force, self.robot, {"left": FakeCamera(), "right": FakeCamera()})
        self.folder = folder / "session"
        self.trajectory: Trajectory = SHORT.trajectory()

    def run(self, progress: Progress = silent) -> None:
        run_session(self.rig, self.devices, self.trajectory, self.folder, Label("test"), progress)

    def load(self, *wrench: float) -> None:
        """Let the force sensor feel so much more from the middle of the first motion on."""
        self.robot.on_the_way = lambda: np.add(self.force.wrench, wrench, out=self.force.wrench)
