"""The catalogue: every effect that is looked for, in the order in which they act, and what else happens to a rig.

The default catalogue holds the effects of this project and those that other installed packages declare, by an entry
point of the group ``retract.effects`` that names an :class:`Effect`, several, or a function that returns one or
several. ``CATALOGUE``, ``OUTSIDERS`` and ``LABELS`` are of the default catalogue.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache

from estimator.effects.blocks import GROUPS, Group
from estimator.effects.effect import OUTSIDE, Effect
from estimator.effects.stages import HOOKS, STAGES
from estimator.effects.standard import EFFECTS as _STANDARD
from estimator.effects.standard import OUTSIDERS as _STANDARD_OUTSIDERS
from estimator.errors import InputError
from estimator.experiment import Experiment
from estimator.plugins import Plugin, plugins

ENTRY_POINTS = "retract.effects"

CATALOGUE: tuple[Effect, ...]
OUTSIDERS: tuple[Effect, ...]
LABELS: dict[str, Group]


@dataclass(frozen=True)
class Catalogue:
    """Effects in the order in which they act, those without a label apart.

    Attributes
    ----------
    effects : by stage, within one in the order in which they were given
    outsiders : what has no label of its own

    Raises
    ------
    InputError
        Two effects have the same label and form, an effect's declarations contradict each other or its methods.

    Examples
    --------
    >>> from estimator import Catalogue
    >>> from estimator.effects.motion.motion_scale import MotionScale
    >>> from estimator.effects.vision.camera_scale import CameraScale
    >>> catalogue = Catalogue((CameraScale(),)).with_effect(MotionScale())
    >>> catalogue.groups
    {'motion_scale': 'robot', 'camera_scale': 'vision'}
    >>> [effect.name for effect in catalogue.forms("camera_scale")]
    ['camera_scale:uniform']
    """

    effects: tuple[Effect, ...]
    outsiders: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        for effect in (*self.effects, *self.outsiders):
            _check(effect)
        by_stage = tuple(sorted(self.effects, key=lambda effect: STAGES.index(effect.stage)))
        object.__setattr__(self, "effects", by_stage)
        _check_together(self.effects, self.outsiders)

    @property
    def groups(self) -> dict[str, Group]:
        """The group of each label, in their order."""
        return {effect.label: effect.group for effect in self.effects}

    @property
    def labels(self) -> tuple[str, ...]:
        """The labels in their order."""
        return tuple(self.groups)

    def forms(self, label: str) -> tuple[Effect, ...]:
        """Return the effects with a label; none where nothing is called so."""
        return tuple(effect for effect in self.effects if effect.label == label)

    def with_effect(self, *more: Effect) -> "Catalogue":
        """Return the catalogue with more effects, each the last of its stage; one without a label is an outsider.

        Raises
        ------
        InputError
            As for the catalogue itself.
        """
        return replace(
            self,
            effects=(*self.effects, *(effect for effect in more if _label(effect) != OUTSIDE)),
            outsiders=(*self.outsiders, *(effect for effect in more if _label(effect) == OUTSIDE)),
        )

    def looked_for_in(self, experiments: Sequence[Experiment]) -> "Catalogue":
        """Return the catalogue as it is looked for in these experiments: what has a size for each has as many."""
        return replace(
            self,
            effects=tuple(effect.looked_for_in(experiments) for effect in self.effects),
            outsiders=tuple(effect.looked_for_in(experiments) for effect in self.outsiders),
        )

    def label_of_law(self, law: str) -> str:
        """Return the label of the effect that a material law's departure from the Neo-Hookean one is."""
        return next((effect.label for effect in self.effects if law in effect.laws), OUTSIDE)


@cache
def default_catalogue() -> Catalogue:
    """Return the effects of this project and of every installed package that declares some.

    Raises
    ------
    InputError
        Naming the package: what it declares cannot be imported, is no effect, or clashes with another.
    """
    return with_plugins(Catalogue(_STANDARD, _STANDARD_OUTSIDERS), plugins(ENTRY_POINTS))


def with_plugins(catalogue: Catalogue, found: Iterable[Plugin]) -> Catalogue:
    """Return the catalogue with the effects that packages declare.

    Raises
    ------
    InputError
        As :func:`default_catalogue`.
    """
    for plugin in found:
        try:
            catalogue = catalogue.with_effect(*_effects_of(plugin))
        except InputError as error:
            raise plugin.refused(str(error)) from error
    return catalogue


def _effects_of(plugin: Plugin) -> tuple[Effect, ...]:
    value = plugin.value
    if callable(value):
        try:
            value = value()
        except Exception as error:
            raise InputError(f"cannot be called: {type(error).__name__}: {error}") from error
    several = value if isinstance(value, (tuple, list)) else (value,)
    effects = tuple(one for one in several if isinstance(one, Effect))
    if not effects or len(effects) < len(several):
        raise InputError(f"brings {type(value).__name__}, which is neither an Effect nor several of them")
    return effects


def _label(effect: Effect) -> str:
    return getattr(effect, "label", "")


def _check(effect: Effect) -> None:
    """Refuse an effect whose declarations are incomplete or contradict its methods."""
    name = type(effect).__name__
    for declared in ("label", "group", "stage", "words", "acts_on"):
        if not getattr(effect, declared, ""):
            raise InputError(f"effect {name} declares no {declared}")
    for word in (effect.label, *filter(None, [effect.form])):
        if not word.isidentifier():
            raise InputError(f"effect {name}: '{word}' is no label or form; write letters, digits and _")
    if effect.group not in GROUPS:
        raise InputError(f"effect {effect.name}: group '{effect.group}' is none of {', '.join(GROUPS)}")
    if effect.stage not in STAGES:
        raise InputError(f"effect {effect.name}: stage '{effect.stage}' is none of {', '.join(STAGES)}")
    overridden = tuple(hook for hook in HOOKS if getattr(type(effect), hook) is not getattr(Effect, hook))
    if set(effect.acts_on) != set(overridden):
        raise InputError(
            f"effect {effect.name} declares that it acts on {', '.join(effect.acts_on)}, and overrides "
            f"{', '.join(overridden) or 'nothing'}"
        )
    names = [*(a.name for a in effect.amplitudes), *(c.name for c in effect.constants)]
    if not effect.amplitudes or len(set(names)) < len(names):
        raise InputError(f"effect {effect.name} needs an amplitude, and parameters of different names")


def _check_together(effects: Iterable[Effect], outsiders: Iterable[Effect]) -> None:
    names: set[str] = set()
    groups: dict[str, Group] = {}
    for effect in (*effects, *outsiders):
        if effect.name in names:
            raise InputError(
                f"effect {effect.name} is in the catalogue already; give it another label or form"
            )
        names.add(effect.name)
        if effect.label != OUTSIDE and groups.setdefault(effect.label, effect.group) != effect.group:
            raise InputError(
                f"effect {effect.name} is of the group {effect.group}, other forms of its label of "
                f"{groups[effect.label]}"
            )
    for effect in effects:
        if effect.elaborates and f"{effect.label}:{effect.elaborates}" not in names:
            raise InputError(
                f"effect {effect.name} elaborates '{effect.elaborates}', which no form is called"
            )


def __getattr__(name: str) -> object:
    """Look for other packages' effects only once they are asked for: theirs may import this module."""
    match name:
        case "CATALOGUE":
            return default_catalogue().effects
        case "OUTSIDERS":
            return default_catalogue().outsiders
        case "LABELS":
            return default_catalogue().groups
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
