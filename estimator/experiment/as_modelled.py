"""What of an experiment a model is compared with: rows in which something strains the phantom, loads in full."""

from dataclasses import replace

import numpy as np

from estimator.experiment.model import Experiment


def as_modelled(experiment: Experiment) -> Experiment:
    """Return the experiment as a model takes it; mostly it is that already.

    A phantom free of stress tells nothing of its stiffness: where the weight acts only after the first row, that row is
    what forces and poses are counted from, and left out. On a gripper that is driven by a load nothing acts besides:
    what is empty of it is zero.
    """
    if experiment.driven == "load":
        experiment = replace(
            experiment,
            wrench=np.nan_to_num(experiment.wrench, nan=0.0),
            sensor=replace(experiment.sensor, force_zero="no_load"),
        )
    if experiment.environment.weight != "acts_after_first_row":
        return experiment
    return replace(
        experiment,
        environment=replace(experiment.environment, weight="acts"),
        sensor=replace(experiment.sensor, force_zero="no_load"),
        first_row="under_load",
        time=experiment.time[1:] - experiment.time[1],
        phase=experiment.phase[1:],
        step=experiment.step[1:],
        position=experiment.position[1:],
        quaternion_wxyz=experiment.quaternion_wxyz[1:],
        wrench=experiment.wrench[1:],
        fiducials=experiment.fiducials[1:],
    )
