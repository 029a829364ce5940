"""MuJoCo as an engine of a handover."""

from __future__ import annotations

import importlib
from functools import partial
from pathlib import Path
from types import ModuleType

from estimator.errors import InputError
from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.terms.term import Term
from estimator.handover.answer import EngineAnswer
from estimator.handover.engine import file_stem
from estimator.handover.model import HandedOver, Tell
from estimator.handover.mujoco.mjcf import mjcf_of
from estimator.handover.mujoco.motion import write_motion
from estimator.handover.mujoco.running import follow
from estimator.materials.material import Material

_MODEL = "phantom.xml"


class MuJoCo:
    """Linear tetrahedra of St. Venant's and Kirchhoff's law, explicit in time: fast, and stiffer than the tissue."""

    name = "MuJoCo"
    terms: tuple[type[Term], ...] = ()
    grading = Grading(grasp_m=5e-3, anchor_m=5e-3, largest_m=10e-3, growth=2.0, layers=1)
    regions = False

    def takes(self, material: Material) -> bool:
        """Tell whether the law's E and ν say what MuJoCo needs: it has one law, whatever ours."""
        return material.law.name in ("neo_hookean", "st_venant_kirchhoff")

    def missing(self) -> str:
        """Return why it cannot be run here."""
        return (
            "" if _module() else "MuJoCo was not found: pip install mujoco, or the extra retraction[mujoco]"
        )

    def version(self) -> str:
        """Return which one is installed."""
        found = _module()
        return f"MuJoCo {found.__version__}" if found else ""

    def differs(self, handed: HandedOver) -> tuple[str, ...]:
        """Return in what a flex is another model than ours."""
        found = [
            "tetrahedra with a constant strain in place of quadratic elements: too stiff, the more so near ν = ½"
        ]
        if handed.material.law.name != "st_venant_kirchhoff":
            found.insert(
                0,
                "St. Venant's and Kirchhoff's law in place of the Neo-Hookean one: alike for small strains; drawn by a "
                "fifth it is stiffer, pressed together it softens",
            )
        return tuple(found)

    def write(self, handed: HandedOver, folder: Path) -> list[Path]:
        """Write the model, and the motion of every experiment as a table."""
        (folder / _MODEL).write_text(mjcf_of(handed), encoding="utf-8")
        motions = [
            write_motion(run, folder / f"{file_stem(run, number)}_motion.csv")
            for number, run in enumerate(handed.runs)
        ]
        return [folder / _MODEL, *motions]

    def run(self, handed: HandedOver, folder: Path, tell: Tell) -> list[EngineAnswer]:
        """Follow every experiment through states of rest."""
        mujoco = _module()
        if mujoco is None:
            raise InputError(self.missing())
        total = sum(len(run.poses) for run in handed.runs)
        answers: list[EngineAnswer] = []
        done = 0
        for run in handed.runs:
            progress = partial(_told, tell, done, total)
            answers.append(follow(mujoco, folder / _MODEL, run, handed.problem, progress))
            done += len(run.poses)
        return answers


def _told(tell: Tell, before: int, total: int, number: int) -> None:
    tell("MuJoCo", before + number, total)


def _module() -> ModuleType | None:
    try:
        return importlib.import_module("mujoco")
    except ImportError:
        return None
