"""The study of section VI on a phantom of one's own: its surface with cavities and regions, held as its file says."""

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np

from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.experiment.reading import read_mounted_phantom
from estimator.studies.paper_tables.block import Motion, unmeasured
from estimator.studies.paper_tables.figures import LIVER_TRUTH
from estimator.studies.paper_tables.grasp_error import Way
from estimator.studies.paper_tables.liver import retracted
from estimator.studies.phantom_tables.recorded import files_of
from estimator.studies.running.case import Row
from estimator.studies.tables.study import Group, Level, Study, Truth
from estimator.surfaces.reading import read_surface

# As shares of the phantom's longest edge: 20 and 60 mm of a liver of 200 mm.
_FAR = (0.1, 0.3)
_STEPS = 10


@dataclass(frozen=True, eq=False)
class OwnSurface:
    """One estimate from one pull of one phantom.

    Attributes
    ----------
    file : that states the phantom and how it is held
    surface : its surface
    planned : the pull, nothing measured yet
    way : in which it is estimated
    """

    file: Path
    surface: Path
    planned: Experiment
    way: Way

    @property
    def name(self) -> str:
        """What is retracted, and how."""
        return f"{self.file}, {_words(self.planned)}, {self.way}"

    @property
    def identity(self) -> str:
        """What its files state, whatever they are called."""
        data = sha256()
        for file in (self.file, *files_of(self.planned)):
            data.update(file.read_bytes())
        return f"pull of a phantom {data.hexdigest()} {self.planned.position.tolist()} {self.way}"

    def run(self) -> Row:
        """Retract on a finer mesh and estimate on a coarser one."""
        surface = read_surface(self.surface, self.planned.phantom.unit).surface
        return retracted(self.planned, surface, self.way)


def own_surface(file: Path) -> Study:
    """Return the study of a phantom.

    Raises
    ------
    InputError
        The file states no surface that is held by anchors and a grasp, or no beads.
    """
    stated = read_mounted_phantom(file)
    surface = stated.phantom.surface
    if surface is None:
        raise InputError(
            f"{file}: the phantom is a block, of which table1 to table5 are; give one with a surface"
        )
    if stated.rollers:
        raise InputError(f"{file}: states a [[roller]], which the paper's method has not; leave it out")
    if not stated.fiducials_rest:
        raise InputError(f"{file}: states no beads; add [fiducials] rest, or retract phantom --beads N")
    name = file.resolve().parent.name
    length = max(stated.phantom.size_m)
    beads = np.array(stated.fiducials_rest)
    pulls = [
        unmeasured(
            stated.phantom,
            stated.anchors,
            stated.grasp,
            beads,
            Motion(_STEPS, share * length / _STEPS).poses(stated.grasp.centre),
        )
        for share in _FAR
    ]

    def levels(way: Way) -> tuple[Level, ...]:
        return tuple(Level(_words(pull), (OwnSurface(file, surface, pull, way),), None) for pull in pulls)

    truth, regions = Truth(*LIVER_TRUTH), stated.phantom.regions
    within = "".join(f" Region {one.name} is {one.modulus_ratio:g} times as stiff." for one in regions)
    return Study(
        f"surface_{name}",
        f"Section VI: {name}",
        (
            f"The phantom that {file.name} states, {1e3 * length:.0f} mm long, {len(beads)} beads.{within} The truth "
            f"is that of the paper's liver, E = {LIVER_TRUTH[0] / 1e3:g} kPa and ν = {LIVER_TRUTH[1]:g}; pulls along x "
            "by a tenth of its length and by three.",
        ),
        (
            Group("the paper's method, linear tetrahedra on finer ones", levels("paper"), truth),
            Group("our element and likelihood, on a finer mesh of it", levels("ours"), truth),
        ),
    )


def _words(pull: Experiment) -> str:
    way = float(np.linalg.norm(pull.position[-1] - pull.position[0]))
    return f"pull of {1e3 * way:.0f} mm"
