"""What the data do not say, in words."""

from collections.abc import Mapping, Sequence

from estimator.diagnosis.result import EffectFinding

# What tells apart what no motion of the gripper can (or hardly).
MEASUREMENTS: Mapping[str, str] = {
    "thickness_error": "measure the phantom's thickness with a calliper",
    "force_axis_gain": "hang a known weight on the gripper along each axis",
    "force_crosstalk": "hang a known weight on the gripper in three poses",
    "force_frame_rotation": "hang a known weight on the gripper in three poses",
    "tool_weight": "move the empty gripper through four poses in free air",
    "force_bias": "read the sensor with the empty gripper before and after",
    "force_drift": "read the sensor with the empty gripper before and after",
    "time_offset": "tap the gripper and compare the two clocks",
    "camera_scale": "compare the beads' spacing at rest with the design grid",
    "camera_rotation": "compare the beads' places at rest with the design grid",
    "motion_scale": "move the empty gripper in view of the cameras",
    "motion_direction": "move the empty gripper in view of the cameras",
}


def what_cannot_be_told(effects: Mapping[str, EffectFinding], credible: Sequence[str]) -> tuple[str, ...]:
    """Return one sentence for each thing that these data leave open."""
    sentences = ["A common gain of all force axes cannot be told from Young's modulus; hang a known weight."]
    if len(credible) > 1:
        sentences.append(f"These data do not decide between {' and '.join(credible)}.")
    for label, effect in effects.items():
        if effect.state == "cannot_tell":
            limits = ", ".join(
                f"{name} below {size.value:.2g} {size.unit if size.unit != '1' else ''}".strip()
                for name, size in effect.detectable.items()
            )
            advice = MEASUREMENTS.get(label)
            sentences.append(
                f"{label} would not show: {limits}" + (f"; {advice}." if advice is not None else ".")
            )
    return tuple(sentences)
