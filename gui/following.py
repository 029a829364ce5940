"""Estimating from a session while it is recorded: from what is on the disk, after every step that has been measured."""

import time
from itertools import islice
from pathlib import Path

from daq.errors import SessionError, SynchronisationError
from daq.recording.folder import INFO_FILE
from daq.recording.reader import Recording
from daq.recording.recorder import CAMERAS_FILE, SIGNALS_FILE
from daq.sync import synchronise
from daq.windows import measuring_windows
from estimator.errors import FitError, SolverError
from estimator.experiment import Experiment
from estimator.fit.estimate import estimate
from estimator.fit.online import Following, advance, follow_from, standing_rows
from estimator.fit.result import Estimate
from gui.job_process import Reporter
from gui.session_list import entry_of
from gui.sources import experiments_of

_POLL_S = 0.1
_PATIENCE_S = 30.0


def follow_session(report: Reporter, session: Path) -> Estimate | None:
    """Show an :class:`~estimator.fit.online.OnlineEstimate` after every step of a running session.

    Returns the estimate of the whole session once it is sealed, None where it was cut off. Until the steps tell E
    from ν, the next ones are waited for.

    Raises
    ------
    RecordingError, RigError, SynchronisationError, VisionError
        What is recorded cannot be read or synchronised.
    SessionError
        The session does not begin.
    InputError, FitError, SolverError
        The phantom cannot be meshed, or the whole session cannot be estimated.
    """
    _wait_for_its_files(report, session)
    following: Following | None = None
    measured = 0
    while True:
        running = entry_of(session).condition == "recording"
        if (now := _measured(session)) > measured:
            measured = now
            experiment = synchronise(Recording(session), report).experiment
            following = _caught_up(report, following or follow_from(experiment), experiment)
        elif running:
            report("waiting for the next step", 0, 0)
            time.sleep(_POLL_S)
        elif entry_of(session).finished:
            return estimate(experiments_of((session,), report), report)
        else:
            return None


def _caught_up(report: Reporter, following: Following, experiment: Experiment) -> Following:
    """Go on through the stays that are new, and show what each of them tells."""
    for stay in islice(standing_rows(experiment), len(following.steps), None):
        step = len(following.steps)
        try:
            following = advance(following, stay)
        except (FitError, SolverError) as error:
            report(f"step {step} does not suffice ({error})", 0, 0)
            return following
        if following.estimate is not None:
            report.show(following.estimate)
    return following


def _wait_for_its_files(report: Reporter, session: Path) -> None:
    """Wait for a session that has been asked for and is not there yet."""
    deadline = time.monotonic() + _PATIENCE_S
    while not all((session / name).exists() for name in (INFO_FILE, SIGNALS_FILE, CAMERAS_FILE)):
        if time.monotonic() > deadline:
            raise SessionError(f"{session}: has not begun within {_PATIENCE_S:g} s; record it again")
        report("waiting for the session to begin", 0, 0)
        time.sleep(_POLL_S)


def _measured(session: Path) -> int:
    """Return how many windows have been measured to their end."""
    try:
        return len(measuring_windows(Recording(session).events))
    except SynchronisationError:
        return 0
