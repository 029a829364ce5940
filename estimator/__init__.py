"""Mechanics and statistics: mesh, materials, forward model, sensitivities, fit, diagnosis. Knows no device, no window.

What a script or a notebook needs is imported from here, and is loaded only once it is asked for:

``read_experiment``, ``read_case``, ``Experiment``
    what was measured, or is planned
``simulate``, ``estimate``, ``diagnose``
    what a phantom would show; what its tissue is; what causes the gap between model and measurement
``Effect``, ``Amplitude``, ``Catalogue``
    departures of the real rig from the model, your own among them
``Law``
    what a hyperelastic law of your own has to have

>>> import estimator
>>> planned = estimator.Experiment.of_block([(0, 0, 0), (0.004, 0, 0)])
>>> (measured,) = estimator.simulate(planned, youngs_modulus=8e3, mesh="coarse")
>>> measured
<Experiment 'pull' of 'virtual': 2 rows in 1 s, the gripper goes 4.0 mm far, 16 fiducials>
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from estimator.api.diagnosing import diagnose
    from estimator.api.estimating import estimate
    from estimator.api.experiments import Experiment, read_case, read_experiment
    from estimator.api.simulating import simulate
    from estimator.effects.catalogue import Catalogue
    from estimator.effects.effect import Amplitude, Effect
    from estimator.materials.law import Law

__all__ = [
    "Amplitude",
    "Catalogue",
    "Effect",
    "Experiment",
    "Law",
    "diagnose",
    "estimate",
    "read_case",
    "read_experiment",
    "simulate",
]

_MODULES = {
    "Amplitude": "estimator.effects.effect",
    "Catalogue": "estimator.effects.catalogue",
    "Effect": "estimator.effects.effect",
    "Experiment": "estimator.api.experiments",
    "Law": "estimator.materials.law",
    "diagnose": "estimator.api.diagnosing",
    "estimate": "estimator.api.estimating",
    "read_case": "estimator.api.experiments",
    "read_experiment": "estimator.api.experiments",
    "simulate": "estimator.api.simulating",
}


def __getattr__(name: str) -> object:
    """Load a name of the front door when it is first asked for: to import all of it takes a second or two."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    """Return the names that completion offers."""
    return sorted(__all__)
