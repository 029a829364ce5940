"""The tissue shrinks or swells from one experiment to the next: no label of the catalogue."""

from estimator.effects.effect import OUTSIDE, Amplitude, Effect, Readings, Values
from estimator.effects.shared.zeroing import with_wrench_zeroed
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.fem.terms.swelling import Swelling
from estimator.fem.terms.term import Term
from estimator.materials.material import Material

_STRAIN = Amplitude("strain_per_experiment", "1", scale=3e-3, smallest=2e-4, lower=-0.03, upper=0.03)


class Shrinkage(Effect):
    """Its natural size changes evenly with each experiment after the first, as it dries, soaks, cools or warms.

    The sensor was zeroed before each experiment; the beads' rest positions were measured before the first.
    """

    label = OUTSIDE
    group = "geometry"
    stage = "tissue"
    acts_on = ("terms", "readings")
    words = "The tissue shrinks or swells from one experiment to the next."
    form = "shrinkage"
    amplitudes = (_STRAIN,)

    def terms(
        self, problem: RetractionProblem, material: Material, experiment: Experiment, values: Values
    ) -> tuple[Term, ...]:
        """Swell the tissue by what has come together before the experiment."""
        if not values[_STRAIN.name]:
            return ()
        strain = values[_STRAIN.name] * (experiment.order - 1)
        return (Swelling.by_strain(problem.body, material, strain),)

    def readings(self, readings: Readings, values: Values) -> Readings:
        """Take the sensor's zero."""
        return with_wrench_zeroed(readings) if values[_STRAIN.name] else readings
