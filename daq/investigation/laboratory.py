"""Where manoeuvres are carried out: what an investigation asks of a laboratory, and the laboratory of a rig file."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from daq.export import export_experiment, sealed_recording
from daq.files.atomic import appearing
from daq.investigation.manoeuvre import Kind, Manoeuvre
from daq.progress import Progress
from daq.recording.folder import RIG_FILE
from daq.recording.reader import Recording
from daq.rig import Rig, read_rig
from daq.session.session import Label, RecordSession
from daq.synchronisation.experiment_rows import brought_together, signal_means
from daq.synchronisation.fiducial_windows import no_fiducials
from daq.synchronisation.windows import measuring_windows
from daq.trajectories.planned import planned_experiment
from estimator.experiment import Experiment, write_experiment
from robot_drivers.protocols import FloatArray

_SESSIONS, _EXPERIMENTS = "sessions", "experiments"


class Laboratory(Protocol):
    """Carries manoeuvres out and measures."""

    @property
    def rig(self) -> Rig:
        """Limits, frames and specimen."""

    @property
    def kinds(self) -> Sequence[Kind]:
        """The kinds of manoeuvres that it can measure."""

    def planned(self, manoeuvre: Manoeuvre, like: Experiment) -> Experiment:
        """Return the rows of a manoeuvre, finite where something will be measured, with what ``like`` states."""

    def carry_out(self, manoeuvre: Manoeuvre, order: int, progress: Progress) -> Path:
        """Carry a manoeuvre out, and return the folder of its experiment.

        Raises
        ------
        MotionLimitError, MotionRefusedError
            A limit forbids it; nothing has moved.
        SoftwareStopError
            A limit was passed: the robot is held.
        """


class RigLaboratory:
    """The laboratory of a rig file: every manoeuvre is a recorded session, and its experiment.

    Parameters
    ----------
    record : carries out one session: :meth:`daq.acquisition.client.Acquisition.record`
    folder : of the investigation
    operator : who records
    """

    kinds: Sequence[Kind] = (
        "pull",
        "tangent",
        "twist",
        "compress",
        "hold",
        "still",
        "tool_poses",
    )

    def __init__(self, rig: Rig, record: RecordSession, folder: Path, operator: str = "") -> None:
        self.rig = rig
        self._record = record
        self._folder = folder
        self._operator = operator

    def planned(self, manoeuvre: Manoeuvre, like: Experiment) -> Experiment:
        """Return the rows of a manoeuvre: a session's experiment has one for each measuring window."""
        rows = planned_experiment(
            manoeuvre.trajectory(), self.rig.specimen, like.sensor, like.order + 1, rows_per_move=0
        )
        return as_measured(manoeuvre, rows, like.fiducials_rest)

    def carry_out(self, manoeuvre: Manoeuvre, order: int, progress: Progress) -> Path:
        """Record a session, and export its experiment.

        Raises
        ------
        DaqError, DeviceError, InputError
            As :meth:`daq.session.session.Session.run` and :func:`daq.export.export_experiment`.
        """
        session = _unused(self._folder / _SESSIONS, order, manoeuvre)
        label = Label(session.name, order, self._operator, manoeuvre.words)
        self._record(manoeuvre.trajectory(), session, label, progress)
        target = _unused(self._folder / _EXPERIMENTS, order, manoeuvre)
        if manoeuvre.kind == "tool_poses":
            with appearing(target) as draft:
                write_experiment(felt_alone(sealed_recording(session)), draft)
        else:
            export_experiment(session, target, progress)
        return target


def felt_alone(recording: Recording) -> Experiment:
    """Return the experiment of a recording without beads: the tissue is out of the jaws, and may be out of view.

    Raises
    ------
    RigError, SynchronisationError
        The session cannot be used.
    """
    rig = read_rig(recording.folder / RIG_FILE, to_connect=False)
    windows = measuring_windows(recording.events)
    signals = signal_means(recording.force, recording.robot, rig, windows)
    return brought_together(recording.info, rig, windows, signals, no_fiducials(windows)).experiment


def as_measured(manoeuvre: Manoeuvre, rows: Experiment, rest: FloatArray) -> Experiment:
    """Return rows in which what a manoeuvre does not measure is empty; what is to be measured yet stands at rest."""
    count = len(rows.time)
    wrench = np.where(np.isfinite(rows.wrench), rows.wrench, 0.0)
    if manoeuvre.kind == "tool_poses":
        return replace(
            rows, wrench=wrench, fiducials_rest=np.empty((0, 3)), fiducials=np.empty((count, 0, 3))
        )
    if np.isfinite(rows.fiducials).any():
        return rows
    return replace(
        rows, wrench=wrench, fiducials_rest=rest, fiducials=np.broadcast_to(rest, (count, *rest.shape)).copy()
    )


def _unused(parent: Path, order: int, manoeuvre: Manoeuvre) -> Path:
    """Return a folder that is not there yet: a session that was interrupted stays where it is."""
    name = f"{order:02d}_{manoeuvre.name}"
    candidates = [name, *(f"{name}_again{number}" for number in range(1, 1000))]
    return next(folder for one in candidates if not (folder := parent / one).exists())
