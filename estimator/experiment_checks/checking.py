"""All checks of an experiment, and of a case of several, before anything is solved."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from estimator.errors import InputError
from estimator.experiment.model import EXPERIMENT_FILE, OBSERVATIONS_FILE, Experiment
from estimator.experiment.reading import case_members, read_unchecked
from estimator.experiment.validation import check_experiment
from estimator.experiment_checks import beads, cases, forces, holding, noise, rows, surroundings, units, work
from estimator.experiment_checks.finding import Finding

Check = Callable[[Experiment], list[Finding]]

CHECKS: dict[str, Check] = {
    "size": units.check_size,
    "grasp": holding.check_grasp,
    "anchors": holding.check_anchors,
    "sheet": holding.check_sheet,
    "start": holding.check_start,
    "places of beads": holding.check_bead_places,
    "order of rows": rows.check_order,
    "repeated rows": rows.check_repeated_rows,
    "units of positions": units.check_travel_unit,
    "units of beads": units.check_bead_unit,
    "beads at rest": beads.check_rest,
    "held beads": beads.check_held_beads,
    "direction of beads": beads.check_common_direction,
    "given loads": forces.check_given_loads,
    "what is measured": noise.check_measured,
    "constant columns": noise.check_constant,
    "stated noise": noise.check_stated_noise,
    "seen noise": noise.check_seen_noise,
    "size of forces": forces.check_sizes_of_forces,
    "force before motion": forces.check_before_motion,
    "same columns": forces.check_same_columns,
    "forces both ways": forces.check_both_ways,
    "work": work.check_work,
    "signs of forces": work.check_signs_of_axes,
    "units of forces": units.check_stiffness,
    "gravity": surroundings.check_gravity,
    "weight": surroundings.check_weight,
    "density": surroundings.check_density,
}
"""Every check by its name; each is a function of the experiment alone, and gives its reason in its docstring."""

# what makes the rest meaningless: there is no motion to judge by, or it is in another unit
_GROUNDS = ("size", "grasp", "anchors", "start", "order of rows", "units of positions", "units of beads")
_ALWAYS_MEANINGFUL = (
    "repeated rows",
    "what is measured",
    "constant columns",
    "stated noise",
    "same columns",
    "size of forces",
    "gravity",
    "density",
)


@dataclass(frozen=True, slots=True)
class Checked:
    """One folder with what was found in it, the wrong before the suspicious before the fine."""

    folder: Path
    findings: tuple[Finding, ...]
    experiment: Experiment | None = None

    @property
    def wrong(self) -> bool:
        """Whether anything is."""
        return any(finding.grade == "wrong" for finding in self.findings)


def check_folder(path: Path | str) -> list[Checked]:
    """Check an experiment folder, or every one in a folder of several, and these against each other.

    What is wrong between them stands with the folder above.

    Raises
    ------
    InputError
        The path is neither.
    """
    folder = Path(path)
    members = case_members(folder)
    checked = [_check_member(member) for member in members]
    together = cases.check_case([one.experiment for one in checked if one.experiment is not None])
    return [*checked, Checked(folder, tuple(_sorted(together)))] if len(members) > 1 else checked


def findings_of(experiment: Experiment) -> list[Finding]:
    """Return what all checks say of an experiment, the worst first; nothing where all is fine."""
    found: list[Finding] = []
    for name, check in CHECKS.items():
        groundless = any(one.grade == "wrong" and one.check in _GROUNDS for one in found)
        if not groundless or name in (*_GROUNDS, *_ALWAYS_MEANINGFUL):
            found += check(experiment)
    return _sorted(found)


def _check_member(folder: Path) -> Checked:
    try:
        experiment = read_unchecked(folder)
    except InputError as error:
        return Checked(folder, (_from_reader(error, folder),))
    found = findings_of(experiment)
    if not any(one.grade == "wrong" for one in found):
        try:
            check_experiment(replace(experiment, path=folder))
        except InputError as error:
            found = [_from_reader(error, folder), *found]
    return Checked(
        folder, (*found, *noise.not_measured(experiment), *holding.not_prevented(experiment)), experiment
    )


def _from_reader(error: InputError, folder: Path) -> Finding:
    """Return the finding that a refusal of the reader is."""
    text = str(error)
    for file in (OBSERVATIONS_FILE, EXPERIMENT_FILE):
        prefix = str(folder / file)
        if text.startswith(prefix):
            place, _, rest = text.removeprefix(prefix).partition(": ")
            what, _, do = rest.partition("; ")
            return Finding("wrong", "reading", what, do, f"{file}{place}")
    what, _, do = text.partition("; ")
    return Finding("wrong", "reading", what, do)


def _sorted(findings: Sequence[Finding]) -> list[Finding]:
    order = {"wrong": 0, "suspicious": 1, "fine": 2}
    return sorted(findings, key=lambda finding: order[finding.grade])
