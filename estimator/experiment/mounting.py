"""Whether experiments are of one phantom in one mounting, so that one model serves them all."""

import filecmp
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from estimator.errors import InputError
from estimator.experiment.model import Experiment, Phantom, TissueRegion


def check_same_mounting(experiments: Sequence[Experiment], rest_tolerance_m: float = math.inf) -> None:
    """Refuse experiments of several phantoms or mountings.

    Parameters
    ----------
    experiments : one or several
    rest_tolerance_m : by which a fiducial's stated rest position may differ from that in the first experiment, m

    Raises
    ------
    InputError
        There is none, or two differ; the message tells in what.
    """
    if not experiments:
        raise InputError("no experiment is given; name one or more experiment folders")
    first = experiments[0]
    if len(experiments) > 1 and any(experiment.prescribed for experiment in experiments):
        raise InputError(
            "[[prescribed]] is of one experiment, whose fiducials lead the boundary; take the experiments one by one"
        )
    for other in experiments[1:]:
        if differs := _difference(first, other, rest_tolerance_m):
            raise InputError(
                f"{other.path or other.name} is not of the same mounting as {first.path or first.name}: {differs} "
                "differ; make them agree, or take the experiments one by one"
            )


def is_same_body(one: Phantom, other: Phantom) -> bool:
    """Tell whether two phantoms are one body: surfaces by what their files hold, wherever these lie."""
    stated = all(
        getattr(one, name) == getattr(other, name)
        for name in ("shape", "size_m", "density", "unit", "stays_flat")
    )
    if not stated or one.surface is None or other.surface is None:
        return stated and one.surface is other.surface
    return _hold_the_same(one.surface, other.surface) and _are_same_regions(one.regions, other.regions)


def _are_same_regions(some: Sequence[TissueRegion], others: Sequence[TissueRegion]) -> bool:
    return len(some) == len(others) and all(
        replace(one, surface=other.surface) == other and _hold_the_same(one.surface, other.surface)
        for one, other in zip(some, others, strict=True)
    )


def _hold_the_same(one: Path, other: Path) -> bool:
    return one == other or filecmp.cmp(one, other, shallow=False)


def _difference(one: Experiment, other: Experiment, rest_tolerance_m: float) -> str:
    """Return in what two mountings differ; nothing where they are one."""
    rest, others = one.fiducials_rest, other.fiducials_rest
    alike = {
        "phantom_id": one.phantom_id == other.phantom_id,
        "[phantom]": is_same_body(one.phantom, other.phantom),
        "[[anchor]]": one.anchors == other.anchors,
        "[[roller]]": one.rollers == other.rollers,
        "[grasp]": one.grasp == other.grasp,
        "[environment] weight": np.array_equal(one.specific_weight, other.specific_weight),
        "[fiducials] rest": rest.shape == others.shape
        and bool(np.all(np.abs(rest - others) <= rest_tolerance_m)),
    }
    return " and ".join(name for name, same in alike.items() if not same)
