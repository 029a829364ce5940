"""What is scored of one answer, whoever gave it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from estimator.blind.scoring.ceiling import Ceiling
from estimator.diagnosis.model.labels import NONE

_CREDIBLE = 0.9


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value and the ends of its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Answer:
    """What is scored of one answer.

    Attributes
    ----------
    verdict : labels, the leading one first; empty where no gap is seen
    probabilities : of the leading single cause, "none" and "unknown" among them
    seconds : that it took, by the clock; of anyone's answers by the processors
    processor_seconds : that all processors together were busy with it; None where it is not told
    credible_set : the smallest set of answers with 90 %
    blocks : probability of each block of the rig that it holds the leading cause
    centre : of a local cause, m; None where none is told
    youngs_modulus, poisson_ratio : with the causes in, Pa and 1; None where they are not told
    before : E and ν without the causes, Pa and 1; None where they are not told
    closure : on held-out experiments; None where it is not told
    ceiling : by label, how often the best possible test would name it; empty where the answer does not say
    """

    verdict: tuple[str, ...]
    probabilities: Mapping[str, float]
    seconds: float
    credible_set: tuple[str, ...]
    blocks: Mapping[str, float] = field(default_factory=dict)
    centre: tuple[float, float, float] | None = None
    youngs_modulus: Estimate | None = None
    poisson_ratio: Estimate | None = None
    before: tuple[float, float] | None = None
    closure: float | None = None
    processor_seconds: float | None = None
    ceiling: Mapping[str, Ceiling] = field(default_factory=dict)

    @property
    def leading(self) -> str:
        """The first label of the verdict, or "none"."""
        return self.verdict[0] if self.verdict else NONE

    @property
    def block(self) -> str:
        """The likeliest block of the rig; empty where none is told."""
        return max(self.blocks, key=lambda name: self.blocks[name], default="")

    @property
    def ranking(self) -> tuple[str, ...]:
        """The leading answer, then the others by their probability."""
        others = sorted(self.probabilities, key=lambda label: -self.probabilities[label])
        return (self.leading, *(label for label in others if label != self.leading))

    @property
    def likeliest(self) -> tuple[str, float]:
        """The most probable answer and its probability."""
        return max(self.probabilities.items(), key=lambda item: item[1])


def credible_set(probabilities: Mapping[str, float]) -> tuple[str, ...]:
    """Return the smallest set of labels that has 90 %, the likeliest first."""
    found: list[str] = []
    together = 0.0
    for label in sorted(probabilities, key=lambda one: -probabilities[one]):
        found.append(label)
        together += probabilities[label]
        if together >= _CREDIBLE:
            break
    return tuple(found)
