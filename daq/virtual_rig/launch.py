"""Starting the virtual rig: its processes, its rig file, its calibration and its truth."""

import multiprocessing
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path

from daq.rig import Latencies, write_rig
from daq.timing.laboratory_time import in_the_time_of
from daq.virtual_rig.child_processes import end_all, told
from daq.virtual_rig.layout import CAMERA_READOUT_S, FORCE_FILTER_S, Addresses, rig_description
from daq.virtual_rig.operator import VirtualOperator
from daq.virtual_rig.processes import DeviceClocks, VirtualRigSettings, run_emulators, solve_phantom
from daq.virtual_rig.rendering.depth_scene import depth_above
from daq.virtual_rig.rendering.scene import flea2_above, flea2_pair

CLOCK_FILE = "clock"
RIG_FILE = "rig.toml"
STEREO_FILE = "stereo.toml"
CAMERA_FILE = "camera.toml"
TRUTH_FILE = "truth.toml"
LATENCIES = Latencies(force_s=FORCE_FILTER_S, cameras_s=CAMERA_READOUT_S)
"""What the rig file knows of the devices' delays."""


@dataclass(frozen=True, slots=True)
class VirtualRig:
    """A running virtual rig.

    Attributes
    ----------
    rig_path, truth_path : its rig file, and where its phantom's true parameters are written
    operator : who works at it
    clocks : what its devices' clocks truly show
    """

    rig_path: Path
    truth_path: Path
    operator: VirtualOperator
    clocks: DeviceClocks
    _notices: Connection

    def notices(self) -> list[str]:
        """Return a line for everything that went wrong in it since the last call."""
        return _lines(self._notices)


@contextmanager
def virtual_rig(
    folder: Path, settings: VirtualRigSettings, in_real_time: bool = False
) -> Iterator[VirtualRig]:
    """Run a virtual rig whose files are in ``folder``, an existing one.

    It has a clock of its own, which waits for whatever emulates it, and on which this process lives meanwhile too; in
    real time it has none, for use beside real devices, which do not wait, and to measure what a busy computer does.

    Raises
    ------
    SessionError
        Its processes did not start.
    """
    clock = None if in_real_time else folder / CLOCK_FILE
    context = multiprocessing.get_context("spawn")
    control, control_end = context.Pipe()
    notices, notices_end = context.Pipe(duplex=False)
    to_solver, from_emulators = context.Pipe()
    processes = [
        context.Process(
            target=solve_phantom, args=(from_emulators, settings.phantom, in_real_time), name="phantom"
        ),
        context.Process(
            target=run_emulators,
            args=(control_end, notices_end, to_solver, settings, clock),
            name="emulators",
        ),
    ]
    for process in processes:
        process.start()
    # the ends that live in the other processes; what stays open here would hide their end from one another
    for far_end in (from_emulators, to_solver, control_end, notices_end):
        far_end.close()
    try:
        clocks: DeviceClocks = told(control, "the virtual rig")
        addresses: Addresses = told(control, "the virtual rig")
        described = rig_description(addresses, _write_calibration(folder, settings))
        rig = replace(
            described, name=_name(described.name, settings), latencies=LATENCIES, laboratory_clock=clock
        )
        write_rig(rig, folder / RIG_FILE)
        _write_truth(folder / TRUTH_FILE, settings)
        running = VirtualRig(
            folder / RIG_FILE, folder / TRUTH_FILE, VirtualOperator(control), clocks, notices
        )
        with in_the_time_of(rig):
            yield running
    finally:
        # what nobody has asked for may be why
        sys.stderr.writelines(f"{notice}\n" for notice in _lines(notices))
        control.close()
        end_all(reversed(processes))


def _lines(notices: Connection) -> list[str]:
    told = []
    try:
        while notices.poll():
            told.append(str(notices.recv()))
    except (EOFError, OSError):
        pass  # it has ended
    return told


def _name(usual: str, settings: VirtualRigSettings) -> str:
    """Return another name where streams are late: what is calibrated there must not be in force elsewhere."""
    late = {"force": settings.force_delay_s, "cameras": settings.camera_delay_s}
    told = [f"{stream} late by {1e3 * delay_s:g} ms" for stream, delay_s in late.items() if delay_s]
    return ", ".join([usual, *told])


def _write_calibration(folder: Path, settings: VirtualRigSettings) -> Path:
    """Write where the cameras truly are, and return the file."""
    if settings.cameras == 1:
        (depth_above() if settings.depth else flea2_above()).save(folder / CAMERA_FILE)
        return folder / CAMERA_FILE
    flea2_pair().save(folder / STEREO_FILE)
    return folder / STEREO_FILE


def _write_truth(path: Path, settings: VirtualRigSettings) -> None:
    lines = ["effects = []", *(f"{name} = {value!r}" for name, value in settings.phantom.truth().items())]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
