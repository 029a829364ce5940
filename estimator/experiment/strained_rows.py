"""An experiment without a first row in which nothing strains the phantom yet."""

from dataclasses import replace

from estimator.experiment.model import Experiment


def strained_rows(experiment: Experiment) -> Experiment:
    """Return the experiment as it is from the second row on, where its weight acts only from there; else as it is.

    A phantom free of stress tells nothing of its stiffness: that row is what forces and poses are counted from.
    """
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
