"""``retract simulate``: write the experiments that a phantom of known material gives, with whatever acts on it."""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from daq.cli.sessions.record import trajectory_name
from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.files.atomic import appearing
from daq.plans import Trial
from daq.rig import Specimen
from daq.trajectories import STANDARD
from daq.trajectories.planned import moves, planned_experiment
from daq.trajectories.routines import NAMED, RETRACTIONS
from daq.virtual_rig.layout import SPECIMEN, placed_beads
from estimator.effects.catalogue import default_catalogue
from estimator.errors import InputError
from estimator.experiment import Experiment, SensorNoise, read_mounted_phantom, write_experiment
from estimator.forward.meshing import mesh_experiment
from estimator.materials import installed_laws, law_named
from estimator.materials.material import Material, make_material
from estimator.simulation.acting import ActingEffect, catalogue_text, read_effect
from estimator.simulation.simulate import simulate_case

_EXAMPLES = """  retract simulate --output cases/soft --youngs-modulus 6000 --poisson-ratio 0.47
  retract simulate --output cases/stiffening --law yeoh2 --shape 0.1 --trajectory pull --seed 7
  retract simulate --output cases/slip --effect gripper_slip=0.005,threshold=1.5
  retract simulate --output cases/lump --effect inhomogeneity=0.7,centre_x=0.01,radius=0.012 --hold 5
  retract simulate --output cases/two --effect force_bias:tissue_frame=bias_fz=0.2 --effect camera_scale=0.01
  retract simulate --output cases/mine --trajectory mine.csv --trajectory twist_and_pull
  retract simulate --output cases/liver --phantom phantoms/liver/phantom.toml --trajectory pull
  retract simulate --effects                 the effects with their forms, parameters, units and usual sizes
  retract diagnose cases/slip"""

_TRUTH = "truth.toml"


class _TellEffects(argparse.Action):
    """Prints the catalogue of effects and ends, as ``--help`` does."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        sys.stdout.write(catalogue_text() + "\n")
        parser.exit()


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "simulate", "write synthetic experiments of a known phantom", _EXAMPLES, run)
    parser.add_argument(
        "--output", type=Path, metavar="DIR", required=True, help="folder of the case; must not exist"
    )
    parser.add_argument(
        "--phantom",
        type=Path,
        metavar="FILE",
        help="phantom.toml that states the phantom and where it is held (default: the block of the virtual laboratory)",
    )
    parser.add_argument(
        "--trajectory",
        type=trajectory_name,
        action="append",
        help=f"{', '.join(RETRACTIONS)}; or a table FILE.csv, or a function FILE.py:NAME; "
        f"repeat for several, done in this order (default: {', '.join(STANDARD)})",
    )
    parser.add_argument(
        "--hold",
        type=float,
        metavar="S",
        action="append",
        default=[],
        help="measure once more at the last step, so long after; repeat for several",
    )
    parser.add_argument(
        "--youngs-modulus", type=float, default=15e3, metavar="PA", help="default: %(default)s"
    )
    parser.add_argument(
        "--poisson-ratio", type=float, default=0.45, metavar="NU", help="default: %(default)s"
    )
    parser.add_argument(
        "--law", choices=sorted(installed_laws()), default="neo_hookean", help="default: %(default)s"
    )
    parser.add_argument(
        "--shape",
        type=float,
        action="append",
        default=[],
        metavar="VALUE",
        help="shape parameters of the law, in order",
    )
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="LABEL[:FORM][=VALUE][,NAME=VALUE...]",
        help="what else acts, in SI units; without a value at its usual size; repeat for several",
    )
    parser.add_argument(
        "--effects", nargs=0, action=_TellEffects, help="list the effects with their parameters, and end"
    )
    parser.add_argument(
        "--force-std", type=float, default=0.02, metavar="N", help="noise (default: %(default)s)"
    )
    parser.add_argument(
        "--torque-std", type=float, default=5e-4, metavar="NM", help="noise (default: %(default)s)"
    )
    parser.add_argument(
        "--fiducial-std", type=float, default=5e-5, metavar="M", help="noise (default: %(default)s)"
    )
    parser.add_argument(
        "--position-std", type=float, default=3e-5, metavar="M", help="noise (default: %(default)s)"
    )
    parser.add_argument(
        "--seed", type=int, default=0, help="of noise and bead positions (default: %(default)s)"
    )


def run(options: argparse.Namespace) -> Result:
    """Simulate every trajectory and write the case with its truth."""
    if options.output.exists():
        raise InputError(f"{options.output}: exists already; give another folder, or remove it first")
    material = make_material(
        law_named(options.law), options.youngs_modulus, options.poisson_ratio, options.shape
    )
    acting = [read_effect(text) for text in options.effect]
    planned = _planned(options)
    with progress() as tell:
        experiments = simulate_case(
            planned, material, options.seed, acting, partial(tell, "solving the equilibria")
        )
    names = _names(experiments)
    with appearing(options.output) as draft:
        for name, experiment in zip(names, experiments, strict=True):
            write_experiment(replace(experiment, name=name), draft / name)
        (draft / _TRUTH).write_text(_truth(material, acting, planned[0]), encoding="utf-8")
    written, truth = [str(options.output / name) for name in names], str(options.output / _TRUTH)
    return Result("\n".join([*written, truth]), {"experiments": written, "truth": truth})


def _names(experiments: Sequence[Experiment]) -> list[str]:
    """Return a name for each folder; what is done again has its number behind its name."""
    names: list[str] = []
    for number, experiment in enumerate(experiments, start=1):
        names.append(f"{experiment.name}_{number}" if experiment.name in names else experiment.name)
    return names


def _planned(options: argparse.Namespace) -> list[Experiment]:
    sensor = SensorNoise(options.force_std, options.torque_std, options.fiducial_std, options.position_std)
    specimen = _specimen(options)
    planned = []
    for order, name in enumerate(options.trajectory or STANDARD, start=1):
        if name in NAMED and name not in RETRACTIONS:
            raise InputError(
                f"--trajectory {name}: is a motion for calibrations, which retracts no tissue; name one of "
                f"{', '.join(RETRACTIONS)}, or a table or function of your own"
            )
        trajectory = Trial(name, holds_s=tuple(options.hold)).lay_out(Path())
        experiment = planned_experiment(trajectory, specimen, sensor, order)
        if not moves(experiment):
            raise InputError(
                f"--trajectory {name}: the gripper never leaves its pose at rest, so no tissue is retracted; "
                "let a step lead elsewhere"
            )
        planned.append(experiment)
    return planned


def _specimen(options: argparse.Namespace) -> Specimen:
    if options.phantom is None:
        return replace(SPECIMEN, fiducials_m=placed_beads(options.seed))
    stated = read_mounted_phantom(options.phantom)
    return Specimen(
        options.phantom.resolve().parent.name,
        stated.phantom,
        stated.anchors,
        stated.grasp,
        stated.environment,
        stated.fiducials_rest,
        stated.rollers,
    )


def _truth(material: Material, acting: Sequence[ActingEffect], experiment: Experiment) -> str:
    """Return the answer to the case, in words that other programs read."""
    names = [parameter.name for parameter in material.law.shape_parameters]
    shape = dict(zip(names, material.shape.tolist(), strict=True))
    labels = [default_catalogue().label_of_law(material.law.name)] if any(shape.values()) else []
    labels += [one.effect.label for one in acting if one.effect.label not in labels]
    lines = [
        f"effects = {json.dumps(list(dict.fromkeys(labels)))}",
        f"youngs_modulus = {material.youngs_modulus!r}",
        f"poisson_ratio = {material.poisson_ratio!r}",
        "",
        "[parameters]",
        f'law = "{material.law.name}"',
        *(f"{name} = {value!r}" for name, value in shape.items()),
    ]
    for one in acting:
        lines += ["", f'[parameters."{one.effect.name}"]']
        lines += [f"{name} = {value!r}" for name, value in one.values.items()]
    return "\n".join([*lines, *_where(acting, experiment)]) + "\n"


def _where(acting: Sequence[ActingEffect], experiment: Experiment) -> list[str]:
    """Return where the first effect that has a place sits in the tissue."""
    for one in acting:
        place = one.effect.place(mesh_experiment(experiment), one.values)
        if place is not None:
            centre, radius = place
            return ["", "[where]", f"centre = {centre.tolist()}", f"radius = {float(radius)!r}"]
    return []
