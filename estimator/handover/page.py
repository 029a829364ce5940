"""The page of a handover: what is in the folder, what was found, in what the engine differs, and how it compares."""

from __future__ import annotations

from collections.abc import Iterator

from estimator.handover.comparison import table
from estimator.handover.engine import Engine
from estimator.handover.found import Found
from estimator.handover.written import Written

_FILES = {
    ".inp": "an experiment as a deck of CalculiX: `ccx NAME` runs it",
    "phantom.xml": "the phantom as a flex of MuJoCo",
    "_motion.csv": "what the mocap body `hand` is to follow: time, position, quaternion (scalar first)",
    "sensors.py": "wraps the observations of any simulator; needs numpy alone",
    "sensors.json": "what sensors and cameras do in each experiment, in the order in which it acts",
    "draws.csv": "draws of E, ν and the causes' parameters with their weights, for domain randomisation",
    "draws.json": "the same as objects",
    "README.md": "this page",
}


def page(found: Found, engine: Engine, written: Written) -> str:
    """Return the page as Markdown."""
    return "\n".join(_lines(found, engine, written)) + "\n"


def _lines(found: Found, engine: Engine, written: Written) -> Iterator[str]:
    handed, tissue = written.handed, found.verdict.tissue
    experiment = handed.runs[0].experiment
    yield from (f"# {experiment.phantom_id} handed over to {engine.name}", "")
    yield "SI units (m, N, Pa, s), tissue frame: z up, origin at the phantom's centre at rest. A wrench is what the"
    yield "tissue exerts on the gripper, with its torque about the gripper's present origin."
    yield from ("", "## What was found", "")
    yield f"* law `{found.law}`, E = {tissue.youngs_modulus.value:.6g} ± {tissue.youngs_modulus.std:.2g} Pa, "
    yield f"  ν = {tissue.poisson_ratio.value:.5g} ± {tissue.poisson_ratio.std:.2g}"
    for answer in found.answers:
        yield f"* answer `{answer.label}`: {100 * answer.probability:.1f} %"
    for cause in found.verdict.causes:
        values = ", ".join(f"{name} = {value:.5g}" for name, value in cause.values.items())
        kept = "handed over" if cause.effect.name in handed.causes else "left out"
        yield f"* `{cause.effect.name}` ({values}): {kept}"
    yield from (f"* left out `{name}`: {why}" for name, why in handed.left_out.items())
    yield from (f"* {note}" for note in written.notes)
    yield from ("", "## Files", "", "| file | what it is |", "| --- | --- |")
    for name in written.files:
        yield f"| `{name}` | {next(what for end, what in _FILES.items() if name.endswith(end))} |"
    yield from ("", f"## In what {engine.name} differs", "")
    differs = engine.differs(handed)
    yield from (f"* {one}" for one in (*differs, *_common(written)))
    yield from ("", "## Compared with our own model", "")
    if not written.compared:
        yield f"{engine.name} was not run: {written.not_run}."
        return
    yield f"{written.version} was run on the same motion. Force: largest difference as a share of our largest. Gap:"
    yield "root mean square misfit to the recording, in units of the sensors' noise. Where the engine has another law,"
    yield "E multiplied by `E ×` brings its forces nearest to ours on this motion, and leaves `force then`."
    yield from ("", table(written.compared))


def _common(written: Written) -> Iterator[str]:
    """Tell what holds of every engine."""
    stages = {run.experiment.name for run in written.handed.runs}
    yield (
        f"the gripper's motion in {len(stages)} experiment(s) is the tissue's own, solved by our model: where the "
        "gripper slips or yields, what is left of its motion is prescribed, not the law of the slip"
    )
    yield "what sensors and cameras do is not in the engine's files: put its observations through `sensors.py`"
