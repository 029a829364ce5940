"""Cases, answers and keys of the blind test."""

import json
import shutil
from pathlib import Path

from daq.bad_input.samples.experiments import retraction
from estimator.blind.scoring.entries.entry import ANSWERS_FORMAT
from estimator.blind.scoring.keys import open_keys
from estimator.blind.sealing.commitment import commit
from estimator.blind.sealing.register import hash_of_answers, register
from estimator.effects.force.force_bias import ForceBias
from estimator.effects.motion.gripper_slip import GripperSlip
from estimator.experiment import write_experiment


def sealed_cases(folder: Path) -> None:
    """Write two cases of a benchmark, each of one experiment."""
    for name in ("one", "two"):
        write_experiment(retraction("pull", 1), folder / "cases" / name / "pull")


def benchmark(folder: Path) -> None:
    """Write answers and keys of two cases."""
    (folder / "answers").mkdir()
    (folder / "keys").mkdir()
    modulus, ratio = {"value": 15e3, "std": 10.0}, {"value": 0.45, "std": 0.001}
    material = {"youngs_modulus": modulus, "poisson_ratio": ratio}
    for name, label in (("one", GripperSlip.label), ("two", ForceBias.label)):
        answer = {
            "verdict": [label],
            "probabilities": {label: 0.9, "none": 0.1},
            "credible_set": [label],
            "gap": {"closure_held_out": 0.8},
            "where": {"blocks": {"gripper": 0.7, "sensor": 0.3}, "centre": [0.01, 0.02, 0.0]},
            "material": {"before": material, "after": material},
            "seconds": 30.5,
        }
        (folder / "answers" / f"{name}.json").write_text(json.dumps(answer, indent=1), encoding="utf-8")
        (folder / "keys" / f"{name}.toml").write_text(
            f'effects = ["{label}"]\nyoungs_modulus = 15000.0\npoisson_ratio = 0.45\n\n[where]\n'
            'centre = [0.01, 0.02, 0.0]\nradius = 0.01\n\n[generator]\nlevel = "clear"\nsigma = [21.5]\n'
            'in_family = "near"\n',
            encoding="utf-8",
        )


def challenge(folder: Path) -> None:
    """Write two cases, keys that they are committed to, and anyone's answers to them."""
    benchmark(folder)
    shutil.rmtree(folder / "answers")
    sealed_cases(folder)
    told = {
        "format": ANSWERS_FORMAT,
        "set": commit(folder / "cases", folder / "keys").set_hash,
        "answered": "2026-11-28T12:00:00+00:00",
        "entry": {"name": "anybody", "authors": ["nobody"], "method": "guessed"},
        "answers": {
            name: {
                "probabilities": {"none": 0.5, "unknown": 0.5},
                "youngs_modulus": {"value": 15e3, "interval95": [14e3, 16e3]},
                "seconds": 1.5,
            }
            for name in ("one", "two")
        },
    }
    (folder / "answers.json").write_text(json.dumps(told, indent=1), encoding="utf-8")
    register(folder / "keys", hash_of_answers(folder / "answers.json"), "anybody")


def opened_benchmark(folder: Path) -> None:
    """Write answers and keys of two cases, whose keys were opened twice."""
    benchmark(folder)
    for _ in range(2):
        open_keys(folder / "keys", "scored answers")
