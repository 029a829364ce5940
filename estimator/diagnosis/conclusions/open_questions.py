"""What the data do not say, in words."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby

from estimator.diagnosis.result import EffectFinding, Quantity
from estimator.diagnosis.search.decision import Doubted
from estimator.effects.catalogue import Catalogue

# So many sizes of one unit are told one by one.
_LISTED = 3


def measurements(catalogue: Catalogue) -> dict[str, str]:
    """Return for labels what tells them apart where no motion of the gripper can, or hardly."""
    return {effect.label: effect.measured_by for effect in catalogue.effects if effect.measured_by}


def what_cannot_be_told(
    effects: Mapping[str, EffectFinding],
    credible: Sequence[str],
    measured_by: Mapping[str, str],
    doubted: Sequence[Doubted] = (),
) -> tuple[str, ...]:
    """Return one sentence for each thing that these data leave open.

    ``measured_by`` is what :func:`measurements` returns.
    """
    sentences = ["A common gain of all force axes cannot be told from Young's modulus; hang a known weight."]
    if len(credible) > 1:
        sentences.append(f"These data do not decide between {' and '.join(credible)}.")
    sentences += [
        f"{one.label} may be a second cause: it raises the log evidence by {one.adds:.1f}, "
        f"where {one.asked:.1f} are asked."
        for one in doubted
    ]
    sentences += [
        f"{label} is not solved: no equilibrium was found with it near where the measurements would put it, so that "
        "it is neither refuted nor borne out."
        for label, effect in effects.items()
        if effect.state == "not_solved"
    ]
    for label, effect in effects.items():
        if effect.state == "cannot_tell":
            limits = (
                ", ".join(_limits(effect.detectable)) or "nothing that it acts on is there or was measured"
            )
            advice = measured_by.get(label)
            sentences.append(
                f"{label} would not show: {limits}" + (f"; {advice}." if advice is not None else ".")
            )
    return tuple(sentences)


def _limits(sizes: Mapping[str, Quantity]) -> Iterator[str]:
    """Yield what each size would have to exceed; of many with one unit, the least and the largest."""
    for _, of_unit in groupby(sizes.items(), key=lambda item: item[1].unit):
        limits = list(of_unit)
        if len(limits) <= _LISTED:
            yield from (_limit(name, size) for name, size in limits)
        else:
            least = min(limits, key=lambda item: item[1].value)
            largest = max(limits, key=lambda item: item[1].value)
            yield f"{len(limits)} sizes, from {_limit(*least)} to {_limit(*largest)}"


def _limit(name: str, size: Quantity) -> str:
    return f"{name} below {size.value:.2g} {size.unit if size.unit != '1' else ''}".strip()
