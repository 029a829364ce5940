"""Every form of every effect that the maker knows, by the labels of the diagnosis."""

from collections.abc import Mapping
from itertools import chain, zip_longest
from typing import Literal, get_args

from estimator.blind.making.effects import material, motion, mounting, outside, sensing
from estimator.blind.making.effects.literature import forms as literature
from estimator.blind.making.effects.literature import outside as further_outside
from estimator.blind.making.scenes.scene import Form

UNKNOWN = "unknown"

# Whose forms a set has: those that the catalogue of the diagnosis was written beside, those of the literature, or both.
FormSet = Literal["catalogue", "others", "mixed"]
FORM_SETS: tuple[FormSet, ...] = get_args(FormSet)

FORMS: dict[str, tuple[Form, ...]] = {
    **material.FORMS,
    **mounting.FORMS,
    **motion.FORMS,
    **sensing.FORMS,
}


def forms_of(form_set: FormSet) -> Mapping[str, tuple[Form, ...]]:
    """Return the forms of a set by their labels; of a mixed one they alternate, those of the literature first."""
    if form_set == "catalogue":
        return FORMS
    if form_set == "others":
        return {label: literature.FORMS[label] for label in FORMS}
    return {label: _alternating(literature.FORMS[label], FORMS[label]) for label in FORMS}


def outside_of(form_set: FormSet) -> tuple[Form, ...]:
    """Return the effects that no label means."""
    known, further = tuple(outside.FORMS.values()), tuple(further_outside.FORMS.values())
    if form_set == "mixed":
        return _alternating(further, known)
    return known if form_set == "catalogue" else further


def _alternating(one: tuple[Form, ...], other: tuple[Form, ...]) -> tuple[Form, ...]:
    return tuple(form for form in chain.from_iterable(zip_longest(one, other)) if form is not None)


# What a laboratory would act on; the two of a double are of different groups.
GROUPS: dict[str, tuple[str, ...]] = {
    "material": (
        "strain_stiffening",
        "second_invariant",
        "viscoelasticity",
        "stress_softening",
        "permanent_set",
        "anisotropy",
    ),
    "inhomogeneity": ("inhomogeneity", "modulus_gradient"),
    "anchor": ("anchor_compliance", "anchor_debonding"),
    "grasp": ("gripper_slip", "grasp_misplacement", "gripper_compliance"),
    "environment": ("support_friction", "gravity_sag"),
    "geometry": ("thickness_error", "prestretch"),
    "force": (
        "force_bias",
        "force_drift",
        "force_axis_gain",
        "force_crosstalk",
        "force_frame_rotation",
        "torque_centre",
        "tool_weight",
    ),
    "timing": ("time_offset",),
    "vision": ("camera_scale", "camera_rotation", "fiducial_mislabel", "fiducial_misread"),
    "robot": ("robot_backlash", "motion_scale", "motion_direction"),
}

GROUP_OF: dict[str, str] = {label: group for group, labels in GROUPS.items() for label in labels}


def form_named(label: str, name: str) -> Form:
    """Return one form of the effect with this label, which may be "unknown"."""
    forms = outside_of("mixed") if label == UNKNOWN else forms_of("mixed")[label]
    return next(form for form in forms if form.name == name)
