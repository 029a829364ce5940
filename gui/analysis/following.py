"""Estimating from a session while it is recorded: from what is on the disk, after every step that has been measured."""

import time
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from daq.errors import SessionError
from daq.frames import IDENTITY
from daq.one_thread import compute_in_one_thread
from daq.recording.folder import INFO_FILE, RIG_FILE
from daq.recording.layout import CAMERAS_FILE, SIGNALS_FILE
from daq.rig import Specimen, read_rig
from daq.synchronisation.experiment_rows import Synchronised
from daq.synchronisation.running import RunningSynchronisation
from daq.trajectories import STANDARD_SPEED, Step, Trajectory
from daq.trajectories.planned import planned_experiment
from estimator.errors import FitError, SolverError
from estimator.experiment import SensorNoise
from estimator.fit.estimate import estimate
from estimator.fit.online import Following, OnlineEstimate, advance, follow_from, renewed, standing_rows
from estimator.fit.result import Estimate
from estimator.fit.settings import FitSettings
from gui.analysis.sources import experiments_of, stated_by
from gui.jobs.process import Reporter
from gui.sessions.session_list import entry_of
from robot_drivers.protocols import FloatArray

_POLL_S = 0.05
_PATIENCE_S = 30.0
PATIENCE_OF_SEAL_S = 60.0
"""A long recording is judged for some time before it is sealed."""


@dataclass(frozen=True, slots=True, eq=False)
class FollowedStep:
    """What the steps of a running session tell up to one of them.

    Attributes
    ----------
    estimate : after the step
    measured_ns : when its measuring window ended, host clock
    beads : (m, 3) where they were in it, tissue frame, m; NaN where one was not seen
    """

    estimate: OnlineEstimate
    measured_ns: int
    beads: FloatArray


def follow_session(
    report: Reporter, session: Path, patience_of_seal_s: float = PATIENCE_OF_SEAL_S
) -> Estimate | None:
    """Show a :class:`FollowedStep` after every step of a running session.

    Returns the estimate of the whole session once it is sealed, None where that has not happened so long after its last
    sample, as of one that was cut off. Until the steps tell E from ν, the next ones are waited for.

    Raises
    ------
    RecordingError, RigError, SynchronisationError, VisionError
        What is recorded cannot be read or synchronised.
    SessionError
        The session does not begin.
    InputError, FitError, SolverError
        The phantom cannot be meshed, or the whole session cannot be estimated.
    """
    compute_in_one_thread()
    _wait_for_its_files(report, session)
    _prepare(read_rig(session / RIG_FILE, to_connect=False).specimen)
    synchronisation = RunningSynchronisation(session)
    following: Following | None = None
    while True:
        # asked first: what is read after the end is all there is
        running = entry_of(session).condition == "recording"
        found = synchronisation.read_on() if running else synchronisation.read_rest()
        if found is not None:
            following = _caught_up(report, following or follow_from(found.experiment), found)
        elif running:
            report("waiting for the next step", 0, 0)
            time.sleep(_POLL_S)
        elif _sealed(report, session, patience_of_seal_s):
            settings = FitSettings(budget=stated_by((session,)))
            return estimate(experiments_of((session,), report), report, settings)
        else:
            return None


def _prepare(specimen: Specimen) -> None:
    """Mesh and solve the phantom at rest for nothing but that all that takes is loaded when the first step is measured.

    There is time for it as long as the phantom is measured at rest.
    """
    at_rest = Trajectory("other", STANDARD_SPEED, (Step(0, "hold", IDENTITY, settle_s=0.0, measure_s=0.0),))
    follow_from(planned_experiment(at_rest, specimen, SensorNoise(1.0, 1.0, 1.0, 1.0), order=1))


def _sealed(report: Reporter, session: Path, patience_s: float) -> bool:
    """Wait until a session that is no longer written has been judged and sealed; False where it was cut off."""
    deadline = time.monotonic() + patience_s
    while not (finished := entry_of(session).finished) and time.monotonic() < deadline:
        report("waiting for the seal", 0, 0)
        time.sleep(_POLL_S)
    return finished


def _caught_up(report: Reporter, following: Following, found: Synchronised) -> Following:
    """Go on through the stays that are new, and show what each of them tells."""
    stays = list(standing_rows(found.experiment))
    row = sum(len(stay.position) for stay in stays[: len(following.steps)])
    for stay in islice(stays, len(following.steps), None):
        step, row = len(following.steps), row + len(stay.position)
        try:
            following = advance(following, stay)
            if following.estimate is not None:
                beads = found.experiment.fiducials[row - 1]
                report.show(FollowedStep(following.estimate, found.windows[row - 1].end_ns, beads))
            following = renewed(following)
        except (FitError, SolverError) as error:
            report(f"step {step} does not suffice ({error})", 0, 0)
            return following
    return following


def _wait_for_its_files(report: Reporter, session: Path) -> None:
    """Wait for a session that has been asked for and is not there yet."""
    deadline = time.monotonic() + _PATIENCE_S
    while not all((session / name).exists() for name in (INFO_FILE, SIGNALS_FILE, CAMERAS_FILE)):
        if time.monotonic() > deadline:
            raise SessionError(f"{session}: has not begun within {_PATIENCE_S:g} s; record it again")
        report("waiting for the session to begin", 0, 0)
        time.sleep(_POLL_S)
