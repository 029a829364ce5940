"""The catalogue as a value: its order, what it refuses, and what other packages add to it."""

from collections.abc import Sequence
from importlib.metadata import EntryPoint
from typing import ClassVar

import numpy as np
import pytest
from effect_cases import felt, there_and_back
from hypothesis import given, settings
from hypothesis import strategies as st

from estimator.effects import standard
from estimator.effects.blocks import GROUPS, Group
from estimator.effects.catalogue import Catalogue, default_catalogue, with_plugins
from estimator.effects.effect import OUTSIDE, Amplitude, Effect, Readings
from estimator.effects.effect import Values as EffectValues
from estimator.effects.stages import HOOKS, STAGES, Hook, Stage
from estimator.errors import InputError
from estimator.materials import LAWS
from estimator.plugins import Plugin, loaded

OWN = Catalogue(standard.EFFECTS, standard.OUTSIDERS)
EVERYTHING = (*OWN.effects, *OWN.outsiders)


class Heat(Effect):
    """The gripper's force reading warms up: a small effect of another package."""

    label: ClassVar[str] = "heat"
    group: ClassVar[Group] = "force"
    stage: ClassVar[Stage] = "force"
    acts_on: ClassVar[tuple[Hook, ...]] = ("readings",)
    words: ClassVar[str] = "The sensor warms up."
    amplitudes = (Amplitude("rate", "N/s", scale=1e-3, smallest=1e-4),)

    def readings(self, readings: Readings, values: EffectValues) -> Readings:
        warming = np.outer(readings.experiment.time, [values["rate"], 0, 0, 0, 0, 0])
        return readings.with_wrench(readings.wrench + warming)


def plugin(value: object) -> Plugin:
    return Plugin("retract.effects", "heat", "hot-lab 1.2", value)


def changed(base: type[Effect], **declared: object) -> Effect:
    """An effect like another one, with other declarations."""
    return type("Changed", (base,), declared)()


def every_parameter(effect: Effect, sizes: Sequence[float]) -> dict[str, float]:
    """Amplitudes of these sizes, in shares of their usual one; constants somewhere in the middle."""
    usual = {"order": 2.0, "time": 50.0, "share_of_time": 0.4, "one": 0.0, "other": 1.0}
    constants = {
        c.name: c.grid[len(c.grid) // 2] if c.grid else usual.get(c.name, 0.0) for c in effect.constants
    }
    amplitudes = {a.name: size * a.scale for a, size in zip(effect.amplitudes, sizes, strict=False)}
    return {**constants, **amplitudes}


def test_the_project_s_own_effects_come_in_the_order_in_which_they_act() -> None:
    assert OWN.effects == standard.EFFECTS
    assert OWN.labels[:3] == ("strain_stiffening", "second_invariant", "viscoelasticity")
    assert OWN.labels[-2:] == ("fiducial_misread", "fiducial_mislabel")
    assert len(OWN.labels) == 33
    growing = ["growing_lag", "growing_lead"]
    of_each = ["lag_of_each_experiment", "lead_of_each_experiment"]
    forms = [effect.form for effect in OWN.forms("time_offset")]
    assert forms == ["lag", "lead", "filtered", *growing, *of_each]
    assert OWN.groups["gripper_slip"] == "grasp"


@pytest.mark.parametrize("effect", EVERYTHING, ids=lambda effect: effect.name)
def test_what_an_effect_declares_is_what_its_methods_do(effect: Effect) -> None:
    overridden = [hook for hook in HOOKS if getattr(type(effect), hook) is not getattr(Effect, hook)]
    assert list(effect.acts_on) == overridden
    of_sensors = {"beads", "seen", "readings"}
    assert effect.acts_on_tissue == (effect.misreads_rest or bool(set(overridden) - of_sensors))
    assert effect.block is GROUPS[effect.group]


@pytest.mark.parametrize(
    "effect", [effect for effect in EVERYTHING if effect.linear], ids=lambda effect: effect.name
)
@settings(max_examples=6, deadline=None)
@given(st.lists(st.floats(-0.9, 0.9), min_size=30, max_size=30), st.floats(-1.0, 1.0))
def test_what_a_linear_effect_changes_is_proportional_to_its_amplitudes(
    effect: Effect, sizes: list[float], factor: float
) -> None:
    motion = there_and_back(order=2, turn_rad=(0.1, 0.2, 0.3))

    def change(values: EffectValues) -> np.ndarray:
        moved, seen = effect.motion(motion, values), effect.readings(felt(motion), values)
        turn = (moved.rotation * motion.rotation.inv()).as_rotvec()
        parts = (moved.position - motion.position, turn, seen.wrench - felt(motion).wrench)
        return np.concatenate([part.ravel() for part in (*parts, seen.fiducials - felt(motion).fiducials)])

    whole = change(every_parameter(effect, sizes))
    share = change(every_parameter(effect, [factor * size for size in sizes]))
    assert share == pytest.approx(factor * whole, abs=1e-12 + 1e-9 * np.abs(whole).max())


@pytest.mark.parametrize("stage", STAGES)
def test_one_more_effect_comes_last_of_its_stage_and_moves_no_other(stage: Stage) -> None:
    more = changed(Heat, stage=stage)
    found = OWN.with_effect(more)
    assert [effect for effect in found.effects if effect is not more] == list(OWN.effects)
    before = [STAGES.index(effect.stage) <= STAGES.index(stage) for effect in found.effects]
    assert found.effects.index(more) == sum(before) - 1
    assert found.outsiders == OWN.outsiders
    assert "heat" not in OWN.labels


def test_an_effect_without_a_label_is_an_outsider() -> None:
    more = changed(Heat, label=OUTSIDE, form="heat")
    assert OWN.with_effect(more).outsiders == (*OWN.outsiders, more)
    assert OWN.with_effect(more).effects == OWN.effects


@pytest.mark.parametrize(
    ("declared", "complaint"),
    [
        (
            {"label": "gripper_slip", "form": "gradual"},
            "effect gripper_slip:gradual is in the catalogue already",
        ),
        ({"label": "gripper_slip"}, "effect gripper_slip is of the group force, other forms .* of grasp"),
        ({"label": "my heat"}, "'my heat' is no label or form; write letters, digits and _"),
        ({"label": ""}, "effect Changed declares no label"),
        ({"group": "weather"}, "effect heat: group 'weather' is none of material, inhomogeneity"),
        ({"stage": "last"}, "effect heat: stage 'last' is none of tissue, mounting"),
        ({"acts_on": ("motion",)}, "effect heat declares that it acts on motion, and overrides readings"),
        ({"amplitudes": ()}, "effect heat needs an amplitude"),
        (
            {"form": "slow", "elaborates": "plain"},
            "effect heat:slow elaborates 'plain', which no form is called",
        ),
    ],
)
def test_a_contradiction_is_told_in_one_line_that_names_the_package(
    declared: dict[str, object], complaint: str
) -> None:
    effect = changed(Heat, **declared)
    with pytest.raises(InputError, match=complaint) as alone:
        OWN.with_effect(effect)
    with pytest.raises(InputError, match=complaint) as packed:
        with_plugins(OWN, [plugin(effect)])
    assert "package hot-lab 1.2, entry point 'heat' of retract.effects" in str(packed.value)
    assert "repair the package or uninstall it" in str(packed.value)
    assert "\n" not in f"{alone.value}{packed.value}"


@pytest.mark.parametrize("value", [Heat, Heat(), (Heat(),), [Heat()], lambda: (Heat(),)])
def test_a_package_may_bring_an_effect_several_or_what_makes_them(value: object) -> None:
    assert "heat" in with_plugins(OWN, [plugin(value)]).labels


def raising() -> Effect:
    raise RuntimeError("no licence")


@pytest.mark.parametrize(
    ("value", "complaint"),
    [
        (3.0, "brings float, which is neither an Effect nor several"),
        ((), "brings tuple, which is neither"),
        ((Heat(), "x"), "brings tuple, which is neither"),
        (raising, "cannot be called: RuntimeError: no licence"),
    ],
)
def test_what_is_no_effect_is_refused_with_the_package_s_name(value: object, complaint: str) -> None:
    with pytest.raises(InputError, match=f"hot-lab 1.2.*{complaint}"):
        with_plugins(OWN, [plugin(value)])


def test_a_package_that_cannot_be_imported_is_named() -> None:
    point = EntryPoint("heat", "a_package_that_is_not_there:EFFECT", "retract.effects")
    with pytest.raises(
        InputError, match=r"entry point 'heat' of retract\.effects: cannot be imported: ModuleNot"
    ):
        loaded([point])


def test_every_law_s_departure_from_the_baseline_is_an_effect() -> None:
    found = {law: OWN.label_of_law(law) for law in LAWS if law != "neo_hookean"}
    assert found.pop("mooney_rivlin") == "second_invariant"
    assert set(found.values()) == {"strain_stiffening"}
    assert OWN.label_of_law("a law of nobody") == OUTSIDE


def test_the_default_catalogue_is_made_once_and_holds_the_project_s_own() -> None:
    assert default_catalogue() is default_catalogue()
    assert set(default_catalogue().effects) >= set(standard.EFFECTS)
