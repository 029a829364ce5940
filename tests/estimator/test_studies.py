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
from estimator.simulation.simulate import Resolution
from estimator.studies.paper_tables import figures
from estimator.studies.paper_tables.block import MOTIONS, SIZE_M, TRUTH, block, measured
from estimator.studies.paper_tables.block_estimates import ByPaper, Ours
from estimator.studies.paper_tables.catalogue import STUDIES, studies_named
from estimator.studies.paper_tables.densities import raised
from estimator.studies.paper_tables.figures import Figure
from estimator.studies.paper_tables.fitting import fitted
from estimator.studies.paper_tables.grasp_error import GraspError, drawn_shift
from estimator.studies.paper_tables.motion_noise import MotionNoise
from estimator.studies.paper_tables.paper_method import estimate_by_paper
from estimator.studies.paper_tables.response import solve_response
from estimator.studies.paper_tables.rough_surface import Relief
from estimator.studies.paper_tables.tetrahedra import block_of_tetrahedra
from estimator.studies.phantom_tables.recorded import RecordedRetraction, recorded
from estimator.studies.running.campaign import run_cases
from estimator.studies.running.case import Case, Outcome, Parametric, Row, digest, run_case
from estimator.studies.running.store import OutcomeStore
from estimator.studies.tables.report import write_studies
from estimator.studies.tables.study import Group, Level, Study, Truth, result_of
from estimator.studies.tables.telling import study_json, study_text

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
                    Figure(11e3, 0.41, 7.0, 9, 30, 1e-4, 2e-3, {"youngs_modulus": 0.05}),
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
    case = GraspError(5e-3, 0, "ours", grading=TINY)
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
    cells = [cell for cell in drawn.split("  ") if cell.strip()]
    assert [cell.strip() for cell in cells] == [
        "10 %",
        "3 of 4",
        "10.67 ± 14 %",  # of 9, 11 and 12 kPa
        "11.00 ± 5 %",
        "+6.7 %",  # against 10 kPa
        "0.4500 ± 0 %",
        "0.4100",
        "+0.0500",
        "0.1",
        "2",
        "9 (30)",
        "2 ± 0 %",
        "7",
        "made up",
    ]
    single = next(line for line in lines if line.startswith("  20 %"))
    assert "+50.0 %" in single
    assert " - " in single
    assert "no estimate: 10 %: no step lowers the misfit" in lines
    level = study_json(result)["groups"][0]["levels"][0]
    assert level["paper"]["iterations"] == 9
    assert level["rmse_force"] == [None, None, None]


def test_the_page_holds_every_table_and_the_picture_is_drawn(tmp_path: Path) -> None:
    result = result_of(KNOWN, run_cases(KNOWN.cases, OutcomeStore(tmp_path / "cases"), threads, silent))
    files = write_studies([result], tmp_path / "out", {"retraction": "0"})
    text = files[0].read_text(encoding="utf-8")
    assert "A study of what is known" in text
    assert text.count("<svg") == 1
    assert "no estimate: 10 %" in text
    assert (tmp_path / "out" / "known.png").stat().st_size > 10_000


def test_without_an_error_of_its_own_a_study_finds_the_truth() -> None:
    row = run_case(MotionNoise(0.0, 0, "ours", grading=TINY)).row
    assert row is not None
    assert row["youngs_modulus"] == pytest.approx(TRUTH.youngs_modulus, rel=1e-4)
    assert row["poisson_ratio"] == pytest.approx(TRUTH.poisson_ratio, abs=1e-4)


@pytest.mark.parametrize("deviation_m", [5e-3, 10e-3, 20e-3])
def test_a_drawn_grasp_error_is_normal_and_leaves_half_of_the_grasp_on_the_tissue(deviation_m: float) -> None:
    shifts = np.array([drawn_shift(deviation_m, draw) for draw in range(200)])
    assert len(np.unique(shifts, axis=0)) == 200
    assert shifts[:, 0].max() <= 0.01 + 1e-12
    # Along y next to nothing is drawn anew.
    assert shifts[:, 1].std() == pytest.approx(deviation_m, rel=0.15)


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
    case = Ours(("pull", "twist_and_pull"), truth=Resolution(TINY, "hex27"), grading=TINY)
    row = run_case(case).row
    assert row is not None
    assert row["youngs_modulus"] == pytest.approx(TRUTH.youngs_modulus, rel=1e-4)


def test_the_papers_method_finds_the_truth_on_the_mesh_of_the_data_and_counts_its_calls() -> None:
    planned = block(MOTIONS["pull"].poses()[::5])
    problem = block_of_tetrahedra(planned, (8, 8, 2))
    seen = measured(planned, problem)
    found = estimate_by_paper([solve_response(problem, planned)], [seen])
    assert found.youngs_modulus == pytest.approx(TRUTH.youngs_modulus, rel=0.01)
    assert found.poisson_ratio == pytest.approx(TRUTH.poisson_ratio, abs=0.005)
    assert found.calls > found.iterations > 2
    assert found.rmse_fiducials_m < 2e-5
    assert set(found.row()) >= {"iterations", "calls", "rmse_fiducials", "rmse_force", "seconds"}


def test_a_relief_raises_the_top_with_its_beads_and_thickens_the_block() -> None:
    relief = Relief.drawn(4e-3, seed=1)
    smooth = block(MOTIONS["pull"].poses())
    rough = raised(smooth, "low", relief)
    up = rough.fiducials_rest - smooth.fiducials_rest
    np.testing.assert_allclose(up[:, 2], relief(smooth.fiducials_rest[:, :2]), atol=1e-12)
    assert 0 <= up[:, 2].min() < up[:, 2].max() <= 4e-3
    flat = np.prod(SIZE_M)
    assert rough.body.volume.sum() / flat - 1 == pytest.approx(relief.mean_m / SIZE_M[2], rel=0.15)


def test_recorded_retractions_are_sorted_by_phantom_trajectory_and_repeat() -> None:
    planned = block(MOTIONS["pull"].poses())
    pull = replace(planned, phantom_id="P07", trajectory_kind="pull")
    repeat = replace(pull, wrench=pull.wrench + 1e-3)
    twist = replace(pull, trajectory_kind="twist_and_pull")
    study = recorded([pull, repeat, twist, replace(pull, phantom_id="P08")])
    assert [group.title for group in study.groups] == [
        "phantom P07, one side anchored",
        "phantom P08, one side anchored",
    ]
    assert [(level.label, len(level.cases)) for level in study.groups[0].levels] == [
        ("pull", 2),
        ("twist and pull", 1),
    ]
    one: Case = RecordedRetraction(pull)
    assert digest(one) == digest(RecordedRetraction(replace(pull, path=Path("elsewhere"))))
    assert digest(one) != digest(RecordedRetraction(repeat))


def test_every_figure_of_the_paper_stands_beside_the_level_that_redoes_it() -> None:
    shown = [
        level.paper
        for study in studies_named(list(STUDIES), draws=1)
        for group in study.groups
        for level in group.levels
        if level.paper is not None
    ]
    tables = (figures.TABLE_I, figures.TABLE_II, figures.TABLE_III, figures.TABLE_IV, figures.TABLE_V)
    for table in tables:
        assert all(any(figure is one for one in shown) for figure in table.values())
    assert any(one is figures.LIVER for one in shown)
    assert figures.TABLE_I["case 1"].seconds == 2452.0
    assert figures.TABLE_III[10e-3].scatter["rmse_force"] == 0.63
    drawn = studies_named(["table3"], draws=1)[0]
    told = study_json(result_of(drawn, [Outcome(None, "not run")] * len(drawn.cases)))
    assert told["groups"][0]["levels"][1]["paper"]["scatter"]["rmse_force"] == 0.63
    assert isinstance(studies_named(["table5"])[0].cases[0], ByPaper)


def test_an_unknown_study_and_no_draw_are_told_in_one_line() -> None:
    with pytest.raises(InputError, match="no study is called 'table9'; choose of table1"):
        studies_named(["table9"])
    with pytest.raises(InputError, match="at least one"):
        studies_named(["table3"], draws=0)
