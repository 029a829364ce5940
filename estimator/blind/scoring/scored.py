"""Cases with their truths and the answers to them, and figures of such."""

from dataclasses import dataclass

from estimator.blind.scoring.answers import Answer
from estimator.blind.scoring.ceiling import ceiling_of
from estimator.blind.scoring.intervals import Figure
from estimator.blind.scoring.keys import Key
from estimator.blind.scoring.labels import GROUPS, answers_to, block_of
from estimator.diagnosis.model.labels import UNKNOWN

# What stands out by so many deviations of the noise can be told apart.
PLAIN = 6.0


@dataclass(frozen=True, slots=True)
class Scored:
    """A case with its truth and the answer to it."""

    name: str
    key: Key
    answer: Answer

    @property
    def truths(self) -> tuple[str, ...]:
        """The right names of the leading cause."""
        return answers_to(self.key.effects)

    @property
    def ceiling(self) -> float | None:
        """How often the best possible test would name every cause at the most; None where that is not known.

        It names the one that is hardest to name no oftener than if it knew the others to the letter.
        """
        if not self.key.effects or len(self.key.sigma) != len(self.key.effects):
            return None
        known = [
            ceiling_of(self.answer.ceiling, (effect,), sigma)
            for effect, sigma in zip(self.key.effects, self.key.sigma, strict=True)
        ]
        shares = [share for share in known if share is not None]
        return min(shares) if len(shares) == len(known) else None

    @property
    def is_right(self) -> bool:
        """Whether the leading answer is among the truths."""
        return self.answer.leading in self.truths

    @property
    def true_block(self) -> str:
        """The block of the rig where the first effect sits; empty where the key does not say."""
        return self.key.block or (block_of(self.truths[0]) if self.truths[0] in GROUPS else "")

    @property
    def names_right_block(self) -> bool:
        """Whether a gap is seen and laid to the right block, be it by a label or by something unknown there."""
        return bool(self.answer.verdict) and self.answer.block == self.true_block


@dataclass(frozen=True, slots=True)
class Metric:
    """A figure with its name, its unit, and the best that can be expected of so many cases where that is known."""

    name: str
    figure: Figure
    unit: str
    ceiling: float | None = None


@dataclass(frozen=True, slots=True)
class Cases:
    """A set of scored cases by what is true of them."""

    everything: tuple[Scored, ...]

    @property
    def clean(self) -> list[Scored]:
        """Without any effect."""
        return [case for case in self.everything if not case.key.effects]

    @property
    def singles(self) -> list[Scored]:
        """With one effect of the catalogue."""
        return [
            case for case in self.everything if len(case.key.effects) == 1 and UNKNOWN not in case.key.effects
        ]

    @property
    def outside(self) -> list[Scored]:
        """With one effect that the catalogue does not hold."""
        return [case for case in self.everything if case.key.effects == (UNKNOWN,)]

    @property
    def outside_with_block(self) -> list[Scored]:
        """Those whose key says on which block of the rig the effect acts."""
        return [case for case in self.outside if case.true_block]

    @property
    def plain(self) -> list[Scored]:
        """With one effect of the catalogue that stands out plainly; without those whose key does not say."""
        return [case for case in self.singles if min(case.key.sigma, default=0.0) >= PLAIN]

    @property
    def with_one_answer(self) -> list[Scored]:
        """All but those with several effects."""
        return [*self.singles, *self.clean, *self.outside]

    @property
    def doubles(self) -> list[Scored]:
        """With several effects."""
        return [case for case in self.everything if len(case.key.effects) > 1]
