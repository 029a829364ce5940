"""Every form of every effect that the maker knows, by the labels of the diagnosis."""

from estimator.blind.making.effects import material, motion, mounting, outside, sensing
from estimator.blind.making.scenes.scene import Form

UNKNOWN = "unknown"

FORMS: dict[str, tuple[Form, ...]] = {
    **material.FORMS,
    **mounting.FORMS,
    **motion.FORMS,
    **sensing.FORMS,
}

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
    forms = outside.FORMS.values() if label == UNKNOWN else FORMS[label]
    return next(form for form in forms if form.name == name)
