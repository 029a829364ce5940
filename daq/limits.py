"""What a rig may do: bounds that each sample is held to."""

from dataclasses import dataclass

from estimator.experiment import Box


@dataclass(frozen=True, slots=True)
class Limits:
    """What stops the robot, and what no trajectory may ask for.

    Attributes
    ----------
    force_n, torque_nm : magnitude of the interaction, as it changed since the rest window
    step_m : largest way of the gripper's origin between two standstills
    speed_m_s : of the gripper's origin
    workspace : box for the gripper's origin, tissue frame, m
    communication_age_s : longest silence of the force sensor or the robot
    force_rate_n_s, torque_rate_nm_s : of the interaction, over 20 ms
    """

    force_n: float
    torque_nm: float
    step_m: float
    speed_m_s: float
    workspace: Box
    communication_age_s: float = 0.25
    force_rate_n_s: float = 200.0
    torque_rate_nm_s: float = 20.0

    def __post_init__(self) -> None:
        rates = ("force_rate_n_s", "torque_rate_nm_s")
        for name in ("force_n", "torque_nm", "step_m", "speed_m_s", "communication_age_s", *rates):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be positive, not {getattr(self, name)!r}")
