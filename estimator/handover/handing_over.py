"""The whole of a handover: the engine's files, the wrapper of its observations, draws, and a page that tells."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from estimator.errors import EstimatorError, InputError
from estimator.experiment import Experiment
from estimator.handover import observations
from estimator.handover.calculix.engine import CalculiX
from estimator.handover.comparison import compare
from estimator.handover.draws import draw, write_draws
from estimator.handover.engine import Engine
from estimator.handover.found import Found
from estimator.handover.model import Tell, hand_over
from estimator.handover.mujoco.engine import MuJoCo
from estimator.handover.page import page
from estimator.handover.written import Written

ENGINES: Mapping[str, Engine] = {"calculix": CalculiX(), "mujoco": MuJoCo()}
PAGE_FILE = "README.md"


@dataclass(frozen=True)
class Wanted:
    """What a handover is to hold: of which engine, how many draws from which seed, whether it is run."""

    engine: str
    draws: int = 200
    seed: int = 1
    verify: bool = False


def write_handover(
    found: Found, experiments: Sequence[Experiment], wanted: Wanted, folder: Path, tell: Tell
) -> Written:
    """Write a handover into a folder, which is made.

    Raises
    ------
    InputError
        The folder holds something, or the engine has no law that is near the tissue's.
    SolverError
        The motion has no equilibrium with our own model.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: is there already; name a folder that is not, or is empty")
    engine = ENGINES[wanted.engine]
    draws = draw(found, wanted.draws, wanted.seed)
    handed = hand_over(found, experiments, engine, engine.grading, tell)
    folder.mkdir(parents=True, exist_ok=True)
    files = engine.write(handed, folder)
    write_draws(draws, folder)
    shutil.copyfile(observations.__file__, folder / "sensors.py")
    steps = {run.experiment.name: list(run.steps) for run in handed.runs}
    rest = {run.experiment.name: run.experiment.fiducials_rest.tolist() for run in handed.runs}
    sensors = {"format": "retraction-sensors/1", "experiments": steps, "stated_rest": rest}
    (folder / "sensors.json").write_text(json.dumps(sensors, indent=1), encoding="utf-8")
    names = (
        *(path.name for path in files),
        "sensors.py",
        "sensors.json",
        "draws.csv",
        "draws.json",
        PAGE_FILE,
    )
    written = Written(folder, names, handed, (), "nobody asked for it (--verify)", found.notes, "")
    if wanted.verify:
        written = _verified(written, engine, tell)
    (folder / PAGE_FILE).write_text(page(found, engine, written), encoding="utf-8")
    return written


def _verified(written: Written, engine: Engine, tell: Tell) -> Written:
    """Run the engine where it is installed."""
    why = engine.missing()
    if why:
        return replace(written, not_run=why)
    try:
        answers = engine.run(written.handed, written.folder, tell)
    except EstimatorError as error:
        return replace(written, not_run=f"it ended before the motion did: {error}")
    compared = tuple(compare(written.handed, answers))
    return replace(written, compared=compared, not_run="", version=engine.version())
