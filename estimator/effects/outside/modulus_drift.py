"""The tissue grows stiffer or softer with time, whatever is done to it: no label of the catalogue."""

import numpy as np

from estimator.effects.effect import OUTSIDE, Amplitude, Effect, Readings, Values


class ModulusDrift(Effect):
    """The modulus changes by a constant rate within the experiments, and by a step from each to the next.

    Silicone that cures, tissue that warms up or dries. Under a prescribed motion every force is proportional to the
    modulus, and no displacement depends on it.
    """

    label = OUTSIDE
    group = "material"
    stage = "tissue"
    acts_on = ("readings",)
    words = "The tissue's stiffness drifts with time."
    form = "modulus_drift"
    amplitudes = (
        Amplitude("log_modulus_per_second", "1/s", scale=5e-4, smallest=5e-5),
        Amplitude("log_modulus_per_experiment", "1", scale=0.05, smallest=5e-3),
    )

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Scale the tissue's wrench."""
        experiment = readings.experiment
        log_factor = values["log_modulus_per_second"] * experiment.time
        log_factor = log_factor + values["log_modulus_per_experiment"] * (experiment.order - 1)
        return readings.with_wrench(np.exp(log_factor)[:, None] * readings.wrench)
