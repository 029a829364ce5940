"""Record a retraction from a script, on emulated devices; the file of your own rig goes in the place of theirs.

python examples/record_on_virtual_rig.py runs/first
"""

import sys
from dataclasses import replace
from pathlib import Path

from daq.acquisition.client import Acquisition
from daq.export import export_experiment
from daq.progress import silent
from daq.rig import read_rig
from daq.session.session import Label
from daq.trajectories import PULL
from daq.virtual_rig.launch import virtual_rig
from daq.virtual_rig.processes import VirtualRigSettings
from daq.virtual_rig.standard import standard_settings
from estimator import Experiment, read_experiment


def main(folder: Path, settings: VirtualRigSettings, steps: int = 3) -> Experiment:
    """Pull by 2 mm a step, write session and experiment into an existing folder, and return the experiment."""
    trajectory = replace(PULL, steps=steps, return_steps=1).trajectory()
    with virtual_rig(folder, settings) as running, Acquisition(read_rig(running.rig_path)) as acquisition:
        for role, identity in acquisition.devices.items():
            print(f"{role}: {identity.model}, {identity.serial}")
        acquisition.record(trajectory, folder / "session", Label("pull", 1), silent)
    export_experiment(folder / "session", folder / "experiment", silent)
    experiment = read_experiment(folder / "experiment")
    print(experiment)
    return experiment


if __name__ == "__main__":
    target = Path(sys.argv[1] if len(sys.argv) > 1 else "runs/first")
    target.mkdir(parents=True, exist_ok=True)
    main(target, standard_settings())
