"""CalculiX as an engine of a handover."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from estimator.fem.discretisation.block_mesh import Grading
from estimator.fem.terms.steady import DeadLoad, NodalSprings
from estimator.fem.terms.term import Term
from estimator.handover.answer import EngineAnswer
from estimator.handover.calculix.deck import deck_of, scaled_card
from estimator.handover.calculix.law import card_of
from estimator.handover.calculix.running import program, run_deck
from estimator.handover.engine import file_stem
from estimator.handover.model import HandedOver, Tell
from estimator.materials.material import Material


class CalculiX:
    """Implicit, quadratic elements, hyperelastic laws; forces and beads within a per cent of ours."""

    name = "CalculiX"
    terms: tuple[type[Term], ...] = (NodalSprings, DeadLoad)
    grading = Grading(grasp_m=1e-3, anchor_m=3e-3, largest_m=12e-3, growth=2.0, layers=1)
    regions = True

    def takes(self, material: Material) -> bool:
        """Tell whether a card is near the material's law."""
        return card_of(material) is not None

    def missing(self) -> str:
        """Return why it cannot be run here."""
        if program():
            return ""
        return "CalculiX was not found: its solver is called ccx; on Debian, apt-get install calculix-ccx"

    def version(self) -> str:
        """Return what ccx says of itself."""
        ccx = program()
        if not ccx:
            return ""
        told = subprocess.run([ccx, "-v"], capture_output=True, text=True, check=False).stdout
        found = re.search(r"Version\s+(\S+)", told)
        return f"CalculiX {found[1]}" if found else "CalculiX"

    def differs(self, handed: HandedOver) -> tuple[str, ...]:
        """Return in what the deck is another model than ours."""
        found = [scaled_card(handed, 1.0).differs]
        if handed.problem.body.mesh.kind == "hex27":
            found.append(
                "elements C3D20R (20 nodes, 8 points) in place of 27 nodes with a projected dilatation: neither "
                "locks, and they part by what the mesh leaves"
            )
        return tuple(filter(None, found))

    def write(self, handed: HandedOver, folder: Path) -> list[Path]:
        """Write a deck for every experiment."""
        written = []
        for number, run in enumerate(handed.runs):
            path = folder / f"{file_stem(run, number)}.inp"
            path.write_text(deck_of(handed, run), encoding="ascii", errors="replace")
            written.append(path)
        return written

    def run(self, handed: HandedOver, folder: Path, tell: Tell) -> list[EngineAnswer]:
        """Run every deck."""
        ccx, answers = program(), []
        for number, run in enumerate(handed.runs):
            tell("CalculiX", number, len(handed.runs))
            answers.append(run_deck(ccx or "ccx", folder / f"{file_stem(run, number)}.inp", handed, run))
        return answers
