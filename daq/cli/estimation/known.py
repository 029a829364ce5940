"""What a command line tells of the tissue and of the sensors beforehand: options of estimation and diagnosis."""

import argparse
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from estimator.errors import InputError
from estimator.experiment import Experiment, SensorNoise
from estimator.experiment.model import BEAD_CHANNELS, WRENCH_CHANNELS
from estimator.fit.settings import FitSettings
from estimator.inference.free_parameter import NormalPrior as Prior
from estimator.materials import installed_laws, law_named

_NO_PRIOR = "none"
_CHANNELS = (*WRENCH_CHANNELS, *BEAD_CHANNELS)
_DEVIATIONS = ("force_std", "torque_std", "fiducial_std", "position_std", "orientation_std")
# as attributes of the parsed options
KNOWN_OPTIONS = ("law", "fix", "prior", "bounds", "noise")


def add_known_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that tell of the tissue and of the sensors."""
    parser.add_argument(
        "--law",
        metavar="NAME",
        default="neo_hookean",
        help=f"of {', '.join(installed_laws())} (default: %(default)s)",
    )
    parser.add_argument(
        "--fix",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter that is known; repeat for several",
    )
    parser.add_argument(
        "--prior",
        action="append",
        default=[],
        metavar="NAME=MEAN+-STD",
        help="what is known of a parameter beforehand, or NAME=none; of poisson_ratio what is usual is supposed, "
        "0.40 to 0.49, and the result tells how much of the answer that is",
    )
    parser.add_argument(
        "--bounds", action="append", default=[], metavar="NAME=LOW:HIGH", help="of a free parameter"
    )
    parser.add_argument(
        "--noise",
        action="append",
        default=[],
        metavar="NAME=STD",
        help=f"of a sensor, in place of what experiment.toml states, SI units; of {', '.join(_DEVIATIONS)}, or of one "
        "channel: fx fy fz tx ty tz, and x y z of every fiducial",
    )


def material_settings_of(options: argparse.Namespace) -> FitSettings:
    """Return what the options tell of the tissue.

    Raises
    ------
    InputError
        An option is not written as its help says, or names what there is not.
    """
    flat = {text.partition("=")[0] for text in options.prior if text.partition("=")[2] == _NO_PRIOR}
    stated = [text for text in options.prior if text.partition("=")[2] != _NO_PRIOR]
    return FitSettings(
        law=law_named(options.law),
        fixed={n: value for n, (value,) in _assigned("--fix", options.fix, "=", 1).items()},
        priors={
            **dict.fromkeys(sorted(flat)),
            **{n: Prior(*pair) for n, pair in _assigned("--prior", stated, "+-", 2).items()},
        },
        bounds={n: (low, high) for n, (low, high) in _assigned("--bounds", options.bounds, ":", 2).items()},
    )


def with_noise_of(options: argparse.Namespace, experiments: Sequence[Experiment]) -> list[Experiment]:
    """Return the experiments with the deviations that the options state.

    Raises
    ------
    InputError
        An option is not written as its help says, or a deviation is none that a sensor has.
    """
    stated = {name: value for name, (value,) in _assigned("--noise", options.noise, "=", 1).items()}
    for name in stated:
        if name not in (*_DEVIATIONS, *_CHANNELS):
            known = ", ".join((*_DEVIATIONS, *_CHANNELS))
            raise InputError(f"--noise {name}: no sensor's deviation is called so; of {known}")
    for name, value in stated.items():
        if not 0 < value < math.inf:
            raise InputError(f"--noise {name}={value:g}: a standard deviation is above 0, in SI units")
    return [replace(one, sensor=_with_deviations(one.sensor, stated)) for one in experiments]


def _with_deviations(sensor: SensorNoise, stated: Mapping[str, float]) -> SensorNoise:
    deviations = {name: stated.get(name, getattr(sensor, name)) for name in _DEVIATIONS}
    own = {name: value for name, value in stated.items() if name in _CHANNELS}
    return replace(sensor, **deviations, by_channel={**_without(sensor.by_channel, stated), **own})


def _without(by_channel: Mapping[str, float], stated: Mapping[str, float]) -> dict[str, float]:
    """Return the deviations of channels that no statement on all of their kind overrides."""
    overridden = {
        "force_std": WRENCH_CHANNELS[:3],
        "torque_std": WRENCH_CHANNELS[3:],
        "fiducial_std": BEAD_CHANNELS,
    }
    gone = {channel for name, channels in overridden.items() if name in stated for channel in channels}
    return {name: value for name, value in by_channel.items() if name not in gone}


def _assigned(option: str, texts: Sequence[str], separator: str, count: int) -> dict[str, list[float]]:
    """Return the numbers that texts such as ``name=1:2`` give to names, so many each.

    Raises
    ------
    InputError
        A text is not written that way.
    """
    found = {}
    for text in texts:
        name, _, numbers = text.partition("=")
        try:
            values = [float(part) for part in numbers.split(separator, count - 1)]
        except ValueError:
            values = []
        if len(values) != count:
            raise InputError(f"{option} {text}: write it as NAME={separator.join(['NUMBER'] * count)}")
        found[name] = values
    return found
