"""Studies: cases that give the same row wherever they run, are kept, and are sorted into tables and pictures."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from estimator.errors import FitError, InputError
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fit.linearisation import silent
from estimator.forward.meshing import mesh_experiment
from estimator.geometry.rough import raised_block
from estimator.simulation.simulate import Resolution
from estimator.studies import paper
from estimator.studies.block import MOTIONS, SIZE_M, TRUTH, block, measured
from estimator.studies.campaign import run_cases
from estimator.studies.case import Case, Parametric, Row, digest, run_case
from estimator.studies.catalogue import STUDIES, studies_named
from estimator.studies.complex_motion import ComplexMotion
from estimator.studies.fitting import fitted
from estimator.studies.grasp_error import GraspError, drawn_shift, grasp_error
from estimator.studies.motion_noise import MotionNoise
from estimator.studies.recorded import RecordedRetraction, recorded
from estimator.studies.report import write_studies
from estimator.studies.rough_surface import CELLS, on_surface
from estimator.studies.store import OutcomeStore
from estimator.studies.study import Group, Level, PaperFigure, Study, Truth, result_of
from estimator.studies.telling import study_json, study_text
from estimator.studies.tetrahedra import block_of_tetrahedra

TINY = Grading(grasp_m=8e-3, anchor_m=15e-3, largest_m=30e-3, growth=3.0, layers=1)


@dataclass(frozen=True)
class Known(Parametric):
    """A case that finds what it is told to, or nothing."""

    youngs_modulus: float
    poisson_ratio: float = 0.45
    fails: bool = False

    @property
    def name(self) -> str:
        return f"known {self.youngs_modulus:g}"

    def run(self) -> Row:
        if self.fails:
            raise FitError("no step lowers the misfit")
        return {
            "youngs_modulus": self.youngs_modulus,
            "poisson_ratio": self.poisson_ratio,
            "seconds": 2.0,
            "remark": "made up",
        }


KNOWN = Study(
    "known",
    "A study of what is known",
    ("It proves nothing.",),
    (
        Group(
            "four draws and one",
            (
                Level(
                    "10 %",
                    (Known(9e3), Known(11e3), Known(12e3), Known(1e3, fails=True)),
                    PaperFigure(change=0.13, scatter=0.05),
                ),
                Level("20 %", (Known(15e3),)),
            ),
            Truth(10e3, 0.4),
        ),
        Group("no truth", (Level("pull", (Known(8e3), Known(8.5e3))),), None),
    ),
)


@contextmanager
def threads() -> Iterator[Executor]:
    with ThreadPoolExecutor(2) as pool:
        yield pool


def never() -> AbstractContextManager[Executor]:
    raise AssertionError("all cases are known: nothing is to be started")


def interrupted_after(count: int) -> Callable[[str, int, int], None]:
    def tell(text: str, done: int, total: int) -> None:
        if text.startswith("done") and done == count:
            raise KeyboardInterrupt

    return tell


def test_a_case_gives_the_same_row_every_time_and_another_draw_another_one() -> None:
    case = GraspError(5e-3, 0, "likelihood", TINY)
    first, again, other = (run_case(c).row for c in (case, case, replace(case, draw=1)))
    assert first is not None
    assert again is not None
    assert other is not None
    assert again["youngs_modulus"] == pytest.approx(first["youngs_modulus"], rel=1e-6)
    assert abs(float(other["youngs_modulus"]) / float(first["youngs_modulus"]) - 1) > 1e-5


def test_what_failed_is_an_outcome_too() -> None:
    outcome = run_case(Known(1.0, fails=True))
    assert outcome.row is None
    assert outcome.failure == "no step lowers the misfit"


def test_no_two_cases_of_the_paper_share_a_name_in_the_store() -> None:
    cases = [case for study in studies_named(["all"], draws=3) for case in study.cases]
    assert len({digest(case) for case in cases}) == len(cases)
    assert len({case.name for case in cases}) > 0.5 * len(cases)


def test_a_stopped_study_goes_on_where_it_was(tmp_path: Path) -> None:
    store = OutcomeStore(tmp_path)
    with pytest.raises(KeyboardInterrupt, match=r"of 7 cases are kept in .*the same command goes on"):
        run_cases(KNOWN.cases, store, threads, interrupted_after(2))
    kept = len(list(tmp_path.glob("*.json")))
    assert kept >= 2
    told: list[int] = []
    outcomes = run_cases(KNOWN.cases, store, threads, lambda text, done, total: told.append(done))
    assert told[0] == kept
    assert told[-1] == 7
    assert [o.row["youngs_modulus"] for o in outcomes if o.row] == [9e3, 11e3, 12e3, 15e3, 8e3, 8.5e3]
    assert run_cases(KNOWN.cases, store, never, silent) == outcomes


def test_a_damaged_result_is_told_in_one_line(tmp_path: Path) -> None:
    store, case = OutcomeStore(tmp_path), Known(1e4)
    store.write(case, run_case(case))
    next(tmp_path.glob("*.json")).write_text('{"row": ', encoding="utf-8")
    with pytest.raises(InputError, match="damaged; remove the file"):
        store.read(case)


def test_the_table_sets_ours_beside_the_papers_figures_and_a_dash_where_there_is_none(tmp_path: Path) -> None:
    result = result_of(KNOWN, run_cases(KNOWN.cases, OutcomeStore(tmp_path), threads, silent))
    lines = study_text(result).splitlines()
    drawn = next(line for line in lines if line.startswith("  10 %"))
    assert "3 of 4" in drawn
    assert "+6.67 %" in drawn  # the mean of 9, 11 and 12 against 10 kPa
    assert "+13.00 %" in drawn  # the paper's
    single = next(line for line in lines if line.startswith("  20 %"))
    assert "+50.00 %" in single
    assert " - " in single
    assert "no estimate: 10 %: no step lowers the misfit" in lines
    level = study_json(result)["groups"][0]["levels"][0]
    assert level["paper"] == {"change": 0.13, "scatter": 0.05, "seconds": None}


def test_the_page_holds_every_table_and_the_picture_is_drawn(tmp_path: Path) -> None:
    result = result_of(KNOWN, run_cases(KNOWN.cases, OutcomeStore(tmp_path / "cases"), threads, silent))
    files = write_studies([result], tmp_path / "out", {"retraction": "0"})
    text = files[0].read_text(encoding="utf-8")
    assert "A study of what is known" in text
    assert text.count("<svg") == 1
    assert "no estimate: 10 %" in text
    assert (tmp_path / "out" / "known.png").stat().st_size > 10_000


def test_without_an_error_of_its_own_a_study_finds_the_truth() -> None:
    row = run_case(MotionNoise(0.0, 0, "likelihood", TINY)).row
    assert row is not None
    assert row["youngs_modulus"] == pytest.approx(TRUTH.youngs_modulus, rel=1e-4)
    assert row["poisson_ratio"] == pytest.approx(TRUTH.poisson_ratio, abs=1e-4)


@pytest.mark.parametrize("error_m", [5e-3, 20e-3])
def test_a_drawn_grasp_error_has_its_length_and_leaves_half_of_the_grasp_on_the_tissue(
    error_m: float,
) -> None:
    shifts = np.array([drawn_shift(error_m, draw) for draw in range(40)])
    np.testing.assert_allclose(np.linalg.norm(shifts, axis=1), error_m)
    assert len(np.unique(shifts, axis=0)) == 40
    assert shifts[:, 0].max() <= 0.01 + 1e-12
    assert len(grasp_error(4, TINY).groups[0].levels[0].cases) == 4


def test_a_coarse_mesh_that_locks_gives_the_truth_once_its_error_is_measured_on_the_mesh_of_the_data() -> (
    None
):
    planned = block(MOTIONS["pull"].poses()[::3])
    fine, coarse = (block_of_tetrahedra(planned, cells) for cells in ((12, 12, 2), (9, 9, 2)))
    seen = measured(planned, fine)
    as_it_is, corrected = fitted(coarse, [seen]), fitted(coarse, [seen], finer=fine)
    assert abs(as_it_is.poisson_ratio.value - TRUTH.poisson_ratio) > 0.01
    assert corrected.youngs_modulus.value == pytest.approx(TRUTH.youngs_modulus, rel=0.01)
    assert corrected.poisson_ratio.value == pytest.approx(TRUTH.poisson_ratio, abs=0.003)


def test_linear_tetrahedra_lock_so_that_they_pull_harder_than_the_tissue_does() -> None:
    planned = block(MOTIONS["pull"].poses()[:2])
    problems = (mesh_experiment(planned, TINY), block_of_tetrahedra(planned, (10, 10, 2)))
    assert np.isclose(problems[1].body.volume.sum(), np.prod(SIZE_M))
    good, locked = (-measured(planned, problem).wrench[-1, 0] for problem in problems)
    assert locked > 1.15 * good


def test_several_motions_are_one_estimate() -> None:
    case = ComplexMotion(("pull", "twist_and_pull"), "likelihood", Resolution(TINY, "hex27"), TINY)
    row = run_case(case).row
    assert row is not None
    assert row["youngs_modulus"] == pytest.approx(TRUTH.youngs_modulus, rel=1e-4)


def test_beads_stand_on_the_rough_surface() -> None:
    surface = raised_block(SIZE_M, 4e-3, seed=1, cells=CELLS)
    smooth = block(MOTIONS["pull"].poses())
    rough = on_surface(smooth, surface)
    np.testing.assert_allclose(rough.fiducials_rest[:, :2], smooth.fiducials_rest[:, :2], atol=1e-9)
    raised = rough.fiducials_rest[:, 2] - smooth.fiducials_rest[:, 2]
    assert 0 <= raised.min() < raised.max() <= 4e-3
    assert rough.grasp.box.upper[2] == pytest.approx(surface.bounds[1, 2])


def test_recorded_retractions_are_sorted_by_phantom_trajectory_and_repeat() -> None:
    planned = block(MOTIONS["pull"].poses())
    pull = replace(planned, phantom_id="P07", trajectory_kind="pull")
    repeat = replace(pull, wrench=pull.wrench + 1e-3)
    twist = replace(pull, trajectory_kind="twist_and_pull")
    study = recorded([pull, repeat, twist, replace(pull, phantom_id="P08")])
    assert [group.title for group in study.groups] == ["phantom P07", "phantom P08"]
    assert [(level.label, len(level.cases)) for level in study.groups[0].levels] == [
        ("pull", 2),
        ("twist and pull", 1),
    ]
    one: Case = RecordedRetraction(pull)
    assert digest(one) == digest(RecordedRetraction(replace(pull, path=Path("elsewhere"))))
    assert digest(one) != digest(RecordedRetraction(repeat))


def test_the_papers_figures_stand_where_they_are_known_and_nowhere_else() -> None:
    figures = {
        (study.name, level.label): level.paper
        for study in studies_named(list(STUDIES), draws=1)
        for group in study.groups
        for level in group.levels
    }
    assert figures["table1", "case 1: high density"].seconds == 2452.0
    assert figures["table1", "case 2: low density"].seconds == 773.0
    assert paper.ROUGH_SURFACE[0.08].change == 0.60
    assert figures["table3", "5 mm"] == PaperFigure(change=-0.08, scatter=0.12)
    assert figures["table3", "10 mm"] == PaperFigure()


def test_an_unknown_study_and_no_draw_are_told_in_one_line() -> None:
    with pytest.raises(InputError, match="no study is called 'table9'; choose of table1"):
        studies_named(["table9"])
    with pytest.raises(InputError, match="at least one"):
        studies_named(["table3"], draws=0)
