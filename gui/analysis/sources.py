"""Where experiments come from: sessions, synchronised once and kept in their folder, and experiment folders."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from daq.export import export_experiment
from daq.progress import Progress
from daq.recording.folder import DERIVED_FOLDER, INFO_FILE, RIG_FILE
from daq.rig import read_rig
from daq.uncertainties import stated_by_calibrations
from estimator.errors import InputError
from estimator.experiment import Experiment, read_case, read_experiment
from estimator.fit.budget.systematic import Stated

EXPERIMENT_FOLDER = "experiment"


def is_session(folder: Path) -> bool:
    """Tell whether a folder is that of a session."""
    return (folder / INFO_FILE).is_file()


def experiments_of(sources: Sequence[Path], progress: Progress) -> list[Experiment]:
    """Return the experiments of sessions, experiment folders and folders of these, sorted by their order.

    Raises
    ------
    InputError
        They are of several phantoms, or a folder holds neither.
    RecordingError, RigError, SynchronisationError
        A session cannot be synchronised.
    """
    found: list[Experiment] = []
    for source in sources:
        found += [_of_session(source, progress)] if is_session(source) else read_case(source)
    phantoms = sorted({experiment.phantom_id for experiment in found})
    if len(phantoms) != 1:
        told = f"{len(phantoms)} phantoms ({', '.join(phantoms)})" if phantoms else "nothing"
        raise InputError(f"what was chosen is of {told}; choose sessions of one phantom in one mounting")
    return _named_apart(sorted(found, key=lambda experiment: experiment.order))


def stated_by(sources: Sequence[Path]) -> Stated:
    """Return the uncertainties that calibrations tell which were in force for the last of these that is a session.

    Raises
    ------
    RigError
        Its rig file or a calibration cannot be read.
    """
    sessions = [source for source in sources if is_session(source)]
    if not sessions:
        return Stated()
    return stated_by_calibrations(read_rig(sessions[-1] / RIG_FILE, to_connect=False))


def _of_session(session: Path, progress: Progress) -> Experiment:
    kept = session / DERIVED_FOLDER / EXPERIMENT_FOLDER
    if kept.is_dir():
        return read_experiment(kept)
    return export_experiment(session, kept, progress)[0]


def _named_apart(experiments: Sequence[Experiment]) -> list[Experiment]:
    """Number the experiments that share a name."""
    shared = Counter(experiment.name for experiment in experiments)
    seen: Counter[str] = Counter()
    named = []
    for experiment in experiments:
        seen[experiment.name] += 1
        number = f" ({seen[experiment.name]})" if shared[experiment.name] > 1 else ""
        named.append(replace(experiment, name=experiment.name + number))
    return named
