"""Numbers as people read them: in handy units, with no more digits than are known."""

import math

from estimator.diagnosis.result import EffectFinding, Gap, Quantity, State

# The units that people read, and how many of them make the SI unit.
_DISPLAY = {
    "1": ("", 1.0),
    "m": ("mm", 1e3),
    "m/N": ("mm/N", 1e3),
    "rad": ("°", math.degrees(1.0)),
    "rad/(N·m)": ("°/(N·m)", math.degrees(1.0)),
    "N·m": ("mN·m", 1e3),
    "N·m/s": ("mN·m/s", 1e3),
    "N/s": ("mN/s", 1e3),
    "Pa": ("kPa", 1e-3),
    "kg": ("g", 1e3),
}
_MOST_DECIMALS = 6
# A gap below so many times the noise alone is a slight one.
_SLIGHT = 1.2
# A share known better than this is told without an uncertainty.
_SURE = 0.005

STATE_WORDS: dict[State, str] = {
    "present": "present",
    "negligible": "present, negligible",
    "absent": "absent",
    "cannot_tell": "cannot tell",
    "not_solved": "not solved",
}


def percent(probability: float) -> str:
    """Return a share in percent; one that is neither nothing nor all never reads as 0 or 100."""
    if not math.isfinite(probability):
        return "–"
    if 0 < probability < 0.005:
        return "< 1 %"
    if 0.995 < probability < 1:
        return "> 99 %"
    return f"{100 * probability:.0f} %"


def share_text(share: float, std: float) -> str:
    """Return a share in percent, and how sure it is where that is known."""
    sure = not math.isfinite(std) or std < _SURE
    return percent(share) if sure else f"{100 * share:.0f} ± {100 * std:.0f} %"


def closure_text(closure: float | None, std: float = math.nan) -> str:
    """Return the share of a gap that closes, in percent, or by how much it widens; and how sure that is.

    With its causes in, a gap may come to lie below the floor, which is an estimate too: no more than all of it closes.
    """
    if closure is None or not math.isfinite(closure):
        return "–"
    if closure < 0:
        return f"widens {share_text(-closure, std)}"
    share = share_text(min(closure, 1.0), std)
    return "all" if share == "100 %" else share


def slight_text(gap: Gap) -> str:
    """Tell that a gap hardly stands above the noise, so that little can be said of a share of it; else empty."""
    excess = gap.before / gap.floor
    return f"the gap stands only {excess:.2f} × above the noise" if excess < _SLIGHT else ""


def sigma(value: float) -> str:
    """Return a misfit in units of the noise."""
    return f"{value:.2f} σ" if math.isfinite(value) else "–"


def words_of(name: str) -> str:
    """Return a label or the name of a parameter in words."""
    return name.replace("_", " ")


def quantity_text(quantity: Quantity) -> str:
    """Return value, standard deviation and unit; the deviation has two digits, the value as many decimals."""
    unit, factor = _display(quantity.unit)
    value, std = factor * quantity.value, factor * quantity.std
    if not math.isfinite(value):
        return "–"
    if math.isfinite(std) and std > 0:
        decimals = max(0, 1 - math.floor(math.log10(std)))
        text = f"{value:.{decimals}f} ± {std:.{decimals}f}"
        if decimals > _MOST_DECIMALS:
            text = f"{value:.2e} ± {std:.1e}"
    else:
        text = f"{value:.3g}"
    return f"{text} {unit}".rstrip()


def size_text(quantity: Quantity) -> str:
    """Return a value and its unit, to two digits."""
    unit, factor = _display(quantity.unit)
    return f"{factor * quantity.value:.2g} {unit}".rstrip() if math.isfinite(quantity.value) else "–"


def parameters_text(finding: EffectFinding) -> str:
    """Return an effect's parameters with their values, in one line."""
    return ", ".join(f"{words_of(name)} {quantity_text(q)}" for name, q in finding.parameters.items())


def detectable_text(finding: EffectFinding) -> str:
    """Return the sizes that the data would show, in one line."""
    sizes = [f"{words_of(name)} {size_text(quantity)}" for name, quantity in finding.detectable.items()]
    return ", ".join(sizes) or "–"


def _display(unit: str) -> tuple[str, float]:
    return _DISPLAY.get(unit, (unit, 1.0))
