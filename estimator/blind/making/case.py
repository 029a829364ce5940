"""Makes one case: draws it, sizes its effects, carries it out, and writes folder and key."""

import json
import shutil
import time
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from estimator.blind.making.effects.catalogue import UNKNOWN, form_named
from estimator.blind.making.plan import Planned
from estimator.blind.making.scenes.outline import Outline
from estimator.blind.making.scenes.parts import Part
from estimator.blind.making.scenes.scene import Drawn, Form, Scene
from estimator.blind.making.scenes.setup import SENSOR, Setup, draw_setup
from estimator.blind.making.scenes.simulate import FINE, PILOT, TRIAL, Carried, carry_out, read
from estimator.blind.making.scenes.sizing import LEVELS, Pilot, Sized, sized
from estimator.blind.making.scenes.stated import experiments_of, with_surface_files
from estimator.blind.making.scenes.wide_setup import WITH_PARTS, draw_wide_setup
from estimator.errors import SolverError
from estimator.experiment import Experiment, write_experiment
from estimator.surfaces.repair import closed_surface

_DRAWS = 6
# A level counts as reached within this factor of its limits.
_SLACK = 1.25


@dataclass(frozen=True)
class Made:
    """A case in memory: its experiments and its answer; outline and parts of a phantom that is no block."""

    experiments: tuple[Experiment, ...]
    truth: dict[str, Any]
    outline: Outline | None = None
    parts: tuple[Part, ...] = ()


def make_case(
    planned: Planned, quick: bool = False, tell: Callable[[int, int], None] = lambda done, total: None
) -> Made:
    """Make a case; ``quick`` carries it out on a very coarse mesh, for trials.

    Raises
    ------
    SolverError
        None of several draws has an equilibrium.
    """
    started = time.process_time()
    forms = tuple(map(form_named, planned.labels, planned.forms))
    failure: SolverError | None = None
    resolution = TRIAL if quick else FINE
    for attempt in range(_DRAWS):
        last = attempt == _DRAWS - 1
        try:
            drawn = _drawn_hidden(planned, forms, attempt, quick)
            if drawn is None:
                continue
            setup, scene, effects, pilot, random = drawn
            carried = carry_out(scene.mechanics, setup.experiments, setup.beads, resolution, tell)
            if pilot and len(effects) == 1:
                effects = [replace(effects[0], sigma=pilot.sigma_as_made(scene, carried, resolution))]
                if not last and not all(map(_reached, forms, effects, planned.levels)):
                    continue
        except SolverError as error:
            failure = error
            continue
        readings = read(scene, carried)
        truth = _truth(planned, setup, effects, carried)
        truth["generator"]["seconds"] = round(time.process_time() - started, 1)
        experiments = experiments_of(setup, scene, readings, random)
        return Made(experiments, truth, setup.mechanics.outline, setup.mechanics.parts)
    raise SolverError(f"{planned.name}: none of {_DRAWS} draws could be made ({failure}); use another seed")


def hidden_scene(planned: Planned, quick: bool = False) -> tuple[Setup, Scene]:
    """Return setup and scene of a case, sized by coarse runs of its three retractions, to be carried out otherwise.

    Raises
    ------
    SolverError
        None of several draws has an equilibrium.
    """
    forms = tuple(map(form_named, planned.labels, planned.forms))
    failure: SolverError | None = None
    for attempt in range(_DRAWS):
        try:
            drawn = _drawn_hidden(planned, forms, attempt, quick)
        except SolverError as error:
            failure = error
            continue
        if drawn is not None:
            return drawn[0], drawn[1]
    raise SolverError(f"{planned.name}: none of {_DRAWS} draws could be made ({failure}); use another seed")


_Drawn = tuple[Setup, Scene, list[Sized], Pilot | None, np.random.Generator]


def _drawn_hidden(planned: Planned, forms: tuple[Form, ...], attempt: int, quick: bool) -> _Drawn | None:
    """Return a draw of a case and the generator after it; None where no size reaches its level, but for the last."""
    random = np.random.default_rng([*planned.seed, attempt])
    setup = draw_wide_setup(random, forms, planned.body) if planned.wide else draw_setup(random, forms)
    pilot = Pilot(setup, TRIAL if quick else PILOT) if forms else None
    effects = _sized_effects(forms, planned.levels, setup, pilot, random) if pilot else []
    if attempt < _DRAWS - 1 and not all(map(_reached, forms, effects, planned.levels)):
        return None
    scene = Scene(setup.mechanics)
    for effect in effects:
        scene = effect.drawn.change(scene)
    return setup, scene, effects, pilot, random


def write_case(made: Made, folder: Path, key: Path) -> None:
    """Write a case and its answer; the folder appears last, whole, so that it tells whether the case is done.

    A key that states the same already is left as it is, for its hash may have been published.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    key.parent.mkdir(parents=True, exist_ok=True)
    staged = folder.with_name(f".{folder.name}.partial")
    if staged.exists():
        shutil.rmtree(staged)
    with with_surface_files(made.experiments, made.outline, made.parts) as experiments:
        for experiment in experiments:
            write_experiment(experiment, staged / experiment.name)
    text = _toml(made.truth)
    if not (key.exists() and _states(key, text)):
        key.write_text(text, encoding="utf-8")
    staged.rename(folder)


def _states(key: Path, text: str) -> bool:
    """Tell whether a key states what a text does, but for its salt and for how long the case took to make."""
    there, new = (tomllib.loads(one) for one in (key.read_text(encoding="utf-8"), text))
    there.pop("salt", None)
    for truth in (there, new):
        truth.get("generator", {}).pop("seconds", None)
    return there == new


def _sized_effects(
    forms: tuple[Form, ...],
    levels: tuple[str, ...],
    setup: Setup,
    pilot: Pilot,
    random: np.random.Generator,
) -> list[Sized]:
    effects = []
    for form, level in zip(forms, levels, strict=True):
        low, high = LEVELS[level]
        target = float(np.exp(random.uniform(np.log(low), np.log(high))))
        seed = int(random.integers(2**31))
        draw = partial(_drawn, form, seed, setup)
        effects.append(sized(pilot, draw, form, target))
    return effects


def _drawn(form: Form, seed: int, setup: Setup, size: float) -> Drawn:
    """Draw the same effect at another size."""
    return form.draw(np.random.default_rng(seed), size, setup.mechanics)


def _reached(form: Form, effect: Sized, level: str) -> bool:
    if form.range[0] == form.range[1]:
        return True
    low, high = LEVELS[level]
    return low / _SLACK <= effect.sigma <= high * _SLACK


def _truth(planned: Planned, setup: Setup, effects: list[Sized], carried: Carried) -> dict[str, Any]:
    law = setup.mechanics.law
    levels = [effect.level for effect in effects]
    named = list(zip(planned.labels, planned.forms, strict=True))
    families = [form_named(*one).family for one in named]
    parameters: dict[str, Any] = {}
    where: dict[str, Any] = {}
    for label, form, effect in zip(planned.labels, planned.forms, effects, strict=True):
        prefix = f"{label}_" if len(effects) > 1 else ""
        if label == UNKNOWN:
            parameters["effect"] = form
        parameters |= {f"{prefix}{name}": value for name, value in effect.drawn.parameters.items()}
        where = where or effect.drawn.where
    return {
        "effects": list(planned.labels),
        "youngs_modulus": law.youngs_modulus,
        "poisson_ratio": law.poisson_ratio,
        "parameters": parameters,
        "where": where,
        "generator": {
            "level": levels[0] if len(levels) == 1 else levels,
            "form": list(planned.forms),
            "in_family": families[0] if len(families) == 1 else families,
            **({"block": form_named(*named[0]).acts_on} if planned.labels == (UNKNOWN,) else {}),
            "sigma": [round(effect.sigma, 2) for effect in effects],
            "size": [round(effect.size, 4) for effect in effects],
            "noise": setup.noise,
            "noise_factor": round(setup.sensor.force_std / SENSOR.force_std, 3),
            "body": _body(setup),
            **_parts(setup),
            "beads": setup.mechanics.beads,
            "anchors": "two" if setup.mechanics.two_sides else "one",
            "seed": list(planned.seed),
            "newton_steps": carried.iterations,
            "free_dof": carried.unknowns,
        },
    }


def _body(setup: Setup) -> str:
    if setup.mechanics.parts:
        return WITH_PARTS
    return type(setup.mechanics.outline).__name__.lower() if setup.mechanics.outline else "block"


def _parts(setup: Setup) -> dict[str, Any]:
    """Return volumes, m³, of the parts of a body, and a region's ratio of moduli; where they lie the case states."""
    outline, told = setup.mechanics.outline, dict[str, Any]()
    if outline is None:
        return told
    for part in setup.mechanics.parts:
        told[f"{part.kind}_m3"] = round(closed_surface(*part.surface(outline), part.kind).volume_m3, 12)
        if part.kind == "region":
            told["region_modulus_ratio"] = part.modulus_ratio
    return told


def _toml(truth: dict[str, Any]) -> str:
    """Write plain values, lists of them, and tables one level deep."""
    plain = [f"{name} = {json.dumps(value)}" for name, value in truth.items() if not isinstance(value, dict)]
    for name, table in truth.items():
        if isinstance(table, dict) and (table or name == "parameters"):
            plain += ["", f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in table.items())]
    return "\n".join(plain) + "\n"
