"""The liver's study of a phantom of one's own, with its cavities, regions and painted patches."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from organ_cases import RATIO, organ

from estimator.errors import InputError
from estimator.experiment import Experiment, read_experiment, write_experiment
from estimator.experiment.reading import PHANTOM_FORMAT
from estimator.geometry.shapes import sphere_surface
from estimator.studies.paper_tables.liver import linear_problem
from estimator.studies.phantom_tables.own_surface import OwnSurface, own_surface
from estimator.studies.phantom_tables.recorded import RecordedRetraction
from estimator.surfaces.reading import read_surface
from estimator.surfaces.writing import write_ply


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """An experiment with an organ, and phantom.toml beside its facts."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RETRACT_CACHE", str(tmp_path / "cache"))
        (tmp_path / "made").mkdir()
        write_experiment(organ(tmp_path / "made", 2), tmp_path / "organ")
        file = tmp_path / "organ" / "experiment.toml"
        text = file.read_text().replace('format = "retraction-experiment/2"', f'format = "{PHANTOM_FORMAT}"')
        file.with_name("phantom.toml").write_text(text)
        yield tmp_path / "organ"


def cases(folder: Path) -> list[OwnSurface]:
    return [case for case in own_surface(folder / "phantom.toml").cases if isinstance(case, OwnSurface)]


def test_each_pull_is_estimated_either_way(folder: Path) -> None:
    study = own_surface(folder / "phantom.toml")
    assert study.name == "surface_organ"
    assert "Region tumour is 3 times as stiff." in " ".join(study.notes)
    found = cases(folder)
    assert [case.way for case in found] == ["paper", "paper", "ours", "ours"]
    assert len({case.identity for case in found}) == 4
    ways = [np.linalg.norm(np.ptp(case.planned.position, axis=0)) for case in found]
    assert ways == pytest.approx([0.016, 0.048, 0.016, 0.048])


def test_the_papers_elements_have_the_region_and_hold_the_painted_patches(folder: Path) -> None:
    planned = cases(folder)[0].planned
    surface = planned.phantom.surface
    assert surface is not None
    problem = linear_problem(planned, read_surface(surface).surface, 0.02)
    assert problem.body.mesh.kind == "tet4"
    # two meshes differ, and none need have an element that lies in the region as a whole
    assert 0.5 * (1.0 + RATIO) < problem.body.modulus.max() < RATIO * (1.0 + 1e-9)
    assert problem.body.mesh.points[problem.gripped, 0].min() > 0.045
    assert problem.body.mesh.points[problem.fixed, 0].max() < -0.045


@pytest.mark.parametrize("name", ["region_tumour.ply", "painted_grasp.vtu"])
def test_another_region_or_painting_is_another_case(folder: Path, name: str) -> None:
    def identities() -> list[str]:
        recorded: Experiment = read_experiment(folder)
        return [RecordedRetraction(recorded).identity, *(case.identity for case in cases(folder))]

    before = identities()
    file = folder / name
    if name.endswith(".ply"):
        write_ply(sphere_surface(0.011, 2), file)
    else:
        file.write_bytes(file.read_bytes() + b"\n")
    assert not set(before) & set(identities())


ROLLER = """[[roller]]
box = [[-0.08, -0.05, -0.03], [0.08, 0.05, -0.01]]
directions = ["z"]

[grasp]"""


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("rest = [", "rest_of_others = [", "fiducials.* rest"),
        ("[grasp]", ROLLER, r"states a \[\[roller\]\], which the paper's method has not; leave it out"),
    ],
)
def test_what_the_study_cannot_take_is_refused(folder: Path, old: str, new: str, told: str) -> None:
    file = folder / "phantom.toml"
    file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=told):
        own_surface(file)
