"""Fill the observations of a planned experiment from a forward model, with the noise that its sensors state.

The mesh and the element are finer than an estimation's, so that estimating from the result commits no inverse crime.
"""

from dataclasses import replace

import numpy as np

from estimator.experiment import Experiment
from estimator.fem.block_mesh import Grading
from estimator.forward.meshing import mesh_experiment
from estimator.forward.model import ForwardModel, Progress
from estimator.materials.material import Material

# Cubic elements: 0.05 % in force and 10 µm in fiducials from the converged solution on the paper's block.
TRUTH_GRADING = Grading(grasp_m=1e-3, anchor_m=3e-3, largest_m=15e-3, growth=2.5, layers=1)


def simulate(
    planned: Experiment, material: Material, seed: int, progress: Progress | None = None
) -> Experiment:
    """Return the experiment as its sensors would have seen it.

    The gripper follows the planned poses exactly; its reported position, the wrench and the fiducials carry white
    noise of the stated standard deviations. The wrench is zero at rest but for its noise.

    Parameters
    ----------
    planned : its pose columns are the true motion; its observations are ignored
    material : of the whole phantom
    seed : of the noise
    progress : called with (states done, states in all)

    Raises
    ------
    InputError
        The phantom cannot be meshed.
    SolverError
        The motion has no equilibrium.
    """
    model = ForwardModel(mesh_experiment(planned, TRUTH_GRADING, "hex64"), [planned])
    schedule = model.schedules[0]
    states = model.predict(material, [range(len(schedule.poses))], progress)[0]
    wrench = np.array([states[state].wrench for state in schedule.state_of_row])
    fiducials = np.array([states[state].fiducials for state in schedule.state_of_row])
    random, sensor = np.random.default_rng(seed), planned.sensor
    deviation = np.repeat([sensor.force_std, sensor.torque_std], 3)
    return replace(
        planned,
        position=planned.position + random.normal(0.0, sensor.position_std, planned.position.shape),
        wrench=wrench + deviation * random.normal(size=wrench.shape),
        fiducials=fiducials + random.normal(0.0, sensor.fiducial_std, fiducials.shape),
        path=None,
    )
