"""``retract simulate``: write the experiments that a phantom of known material would give."""

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path

from daq.cli.verb import Result, Verbs, add_verb, progress
from daq.planned import planned_experiment
from daq.trajectories import STANDARD
from daq.virtual_rig.layout import SPECIMEN, placed_beads
from estimator.experiment import SensorNoise, write_experiment
from estimator.materials import LAWS, law_named
from estimator.materials.material import Material, make_material
from estimator.simulation.simulate import simulate

_EXAMPLES = """  retract simulate --output cases/soft --youngs-modulus 6000 --poisson-ratio 0.47
  retract simulate --output cases/stiffening --law yeoh2 --shape 0.1 --trajectory pull --seed 7
  retract estimate cases/soft"""

# What a laboratory calls the departure of each law from the Neo-Hookean one.
_EFFECT = {name: "second_invariant" if name == "mooney_rivlin" else "strain_stiffening" for name in LAWS}


def add_parser(verbs: Verbs) -> None:
    """Add the verb."""
    parser = add_verb(verbs, "simulate", "write synthetic experiments of a known phantom", _EXAMPLES, run)
    parser.add_argument(
        "--output", type=Path, metavar="DIR", required=True, help="folder of the case; must not exist"
    )
    parser.add_argument(
        "--trajectory",
        choices=sorted(STANDARD),
        action="append",
        help="repeat for several (default: all three)",
    )
    parser.add_argument(
        "--youngs-modulus", type=float, default=15e3, metavar="PA", help="default: %(default)s"
    )
    parser.add_argument(
        "--poisson-ratio", type=float, default=0.45, metavar="NU", help="default: %(default)s"
    )
    parser.add_argument("--law", choices=sorted(LAWS), default="neo_hookean", help="default: %(default)s")
    parser.add_argument(
        "--shape",
        type=float,
        action="append",
        default=[],
        metavar="VALUE",
        help="shape parameters of the law, in order",
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
    material = make_material(
        law_named(options.law), options.youngs_modulus, options.poisson_ratio, options.shape
    )
    sensor = SensorNoise(options.force_std, options.torque_std, options.fiducial_std, options.position_std)
    specimen = replace(SPECIMEN, fiducials_m=placed_beads(options.seed))
    kinds = options.trajectory or list(STANDARD)
    written = []
    with progress() as tell:
        for number, kind in enumerate(kinds):
            planned = planned_experiment(STANDARD[kind].trajectory(), specimen, sensor, order=number + 1)
            experiment = simulate(
                planned, material, options.seed + number, partial(tell, f"simulating {kind}")
            )
            written.append(str(write_experiment(experiment, options.output / kind).path))
    truth = options.output / "truth.toml"
    truth.write_text(_truth(material))
    return Result("\n".join([*written, str(truth)]), {"experiments": written, "truth": str(truth)})


def _truth(material: Material) -> str:
    """Return the answer to the case, in words that other programs read."""
    names = [parameter.name for parameter in material.law.shape_parameters]
    shape = dict(zip(names, material.shape.tolist(), strict=True))
    lines = [
        f"effects = {[_EFFECT[material.law.name]] if any(shape.values()) else []}".replace("'", '"'),
        f"youngs_modulus = {material.youngs_modulus!r}",
        f"poisson_ratio = {material.poisson_ratio!r}",
        "",
        "[parameters]",
        f'law = "{material.law.name}"',
    ]
    return "\n".join([*lines, *(f"{name} = {value!r}" for name, value in shape.items())]) + "\n"
