"""How well the time of the streams is found on the virtual rig, whose clocks and delays are known.

``python -m daq.virtual_rig.latency_benchmark`` records a sway, or taps, with the real drivers, calibrates the time from
it, and prints for each stream the latency that was found, the true one, and the error of its clock after estimation.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daq.calibration.latencies import CAMERAS, FORCE, calibrate_time
from daq.calibration.procedures import MOTIONS, record_motion
from daq.devices import connected
from daq.progress import silent
from daq.recording.folder import RIG_FILE
from daq.recording.reader import Recording
from daq.rig import make_devices, read_rig
from daq.synchronisation.stereo_images import StereoImages
from daq.synchronisation.stream_times import force_times, robot_times
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.layout import FORCE_FILTER_S
from daq.virtual_rig.processes import DeviceClocks
from daq.virtual_rig.standard import CAMERA_DELAY_S, FORCE_DELAY_S, calibration_settings
from robot_drivers.cameras.emulator import BusClock
from robot_drivers.protocols import FloatArray, IntArray

ROBOT = "robot"


@dataclass(frozen=True, slots=True)
class StreamTime:
    """What is known of one stream's time.

    Attributes
    ----------
    found_s, std_s : the latency against the robot, as calibrated; NaN for the robot itself
    true_s : its delay, and how much later its estimated times are than the robot's
    clock_error_s : largest departure of the estimated times from the true ones, but for a constant
    """

    found_s: float
    std_s: float
    true_s: float
    clock_error_s: float

    @property
    def error_s(self) -> float:
        """The error of the latency."""
        return self.found_s - self.true_s


def measure(motion: str, folder: Path, seed: int = 0) -> dict[str, StreamTime]:
    """Calibrate the time of a virtual rig in ``folder``, an existing one, and compare by stream."""
    with virtual_rig(folder, calibration_settings("time", seed), in_real_time=True) as running:
        rig = read_rig(running.rig_path)
        with connected(make_devices(rig)) as devices:
            recording = record_motion("time", motion, rig, devices, folder / "session", silent)
    return compare(recording, running.clocks)


def compare(recording: Recording, clocks: DeviceClocks) -> dict[str, StreamTime]:
    """Compare what a recording of the virtual rig tells with the truth."""
    rig = read_rig(recording.folder / RIG_FILE)
    force, robot, images = recording.force, recording.robot, StereoImages(recording, rig)
    left = recording.images(rig.cameras[0].name)
    late = {
        ROBOT: _late_s(robot_times(robot).time_ns, clocks.robot, robot.device_time_s),
        FORCE: _late_s(force_times(force, rig).time_ns, clocks.force, force.device_time_s),
        CAMERAS: _late_s(
            images.times[f"camera {rig.cameras[0].name}"].time_ns, clocks.cameras, left.device_time_s
        ),
    }
    # the times have what the rig file knows taken off; the truth is what it was in all
    delays = {
        FORCE: FORCE_FILTER_S + FORCE_DELAY_S + rig.latencies.force_s,
        CAMERAS: CAMERA_DELAY_S + rig.latencies.cameras_s,
    }
    robot_late = float(late[ROBOT].mean())
    result = {ROBOT: StreamTime(float("nan"), float("nan"), robot_late, _swing(late[ROBOT]))}
    for told in calibrate_time(recording, silent).result.streams:
        stream = late[told.stream]
        true_s = delays[told.stream] + float(stream.mean()) - robot_late
        result[told.stream] = StreamTime(told.latency_s, told.std_s, true_s, _swing(stream))
    return result


def _late_s(estimated_ns: IntArray, clock: BusClock, device_time_s: FloatArray) -> FloatArray:
    """Return by how much (n,) the estimated times of samples are later than the true ones."""
    truth = [clock.host_time_ns(time_s) for time_s in device_time_s.tolist()]
    return np.asarray((estimated_ns - np.array(truth)) * 1e-9, dtype=np.float64)


def _swing(late_s: FloatArray) -> float:
    return float(np.abs(late_s - np.median(late_s)).max())


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what was found and what is true."""
    parser = argparse.ArgumentParser(
        prog="python -m daq.virtual_rig.latency_benchmark", description=main.__doc__
    )
    parser.add_argument("--motion", choices=MOTIONS["time"], default=MOTIONS["time"][0])
    parser.add_argument("--repeat", type=int, default=1, metavar="N", help="times (default: %(default)s)")
    options = parser.parse_args(arguments)
    for number in range(options.repeat):
        with tempfile.TemporaryDirectory(prefix="latency-") as folder:
            told = measure(options.motion, Path(folder), seed=number)
        for stream, time in told.items():
            found = (
                f"its times are {time.true_s * 1e3:+.3f} ms late"
                if stream == ROBOT
                else f"latency {time.found_s * 1e3:.3f} ± {time.std_s * 1e3:.3f} ms, truth {time.true_s * 1e3:.3f} ms, "
                f"error {time.error_s * 1e3:+.3f} ms"
            )
            sys.stdout.write(f"{stream}: {found}; clock within {time.clock_error_s * 1e3:.3f} ms\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
