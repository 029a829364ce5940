"""One line of a plan, and the trajectory that it means."""

import hashlib
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TypeVar

from daq.errors import TrajectoryError
from daq.trajectories import STANDARD, STANDARD_SPEED, Dwell, Trajectory, lay_out
from daq.trajectories.own import load_function, read_table
from daq.trajectories.routines import NAMED, repeated
from robot_drivers.protocols import Speed

T = TypeVar("T")

MOST_SESSIONS = 10_000
_MOST_ROUNDS = 1000


@dataclass(frozen=True, slots=True)
class Trial:
    """One line of a plan; what is None is as the trajectory has it.

    Attributes
    ----------
    trajectory : a name of :data:`daq.trajectories.routines.NAMED`, a CSV table, or ``file.py:function``
    repeat : how many sessions
    rounds : how often the steps are gone through within one session
    steps, step_length_m, angle_rad, return_steps, speed_m_s : of a standard retraction; a function takes steps,
        return_steps and speed, a table the speed
    settle_s, measure_s, holds_s : of the standing still
    notes : free text
    """

    trajectory: str
    repeat: int = 1
    rounds: int = 1
    steps: int | None = None
    step_length_m: float | None = None
    angle_rad: float | None = None
    return_steps: int | None = None
    speed_m_s: float | None = None
    settle_s: float | None = None
    measure_s: float | None = None
    holds_s: tuple[float, ...] = ()
    notes: str = ""

    def __post_init__(self) -> None:
        if not (1 <= self.repeat <= MOST_SESSIONS and 1 <= self.rounds <= _MOST_ROUNDS):
            raise ValueError(
                f"repeat and rounds must be at least 1, at most {MOST_SESSIONS} and {_MOST_ROUNDS}"
            )

    @property
    def digest(self) -> str:
        """A short name of what is done, whatever is noted about it and however often."""
        text = json.dumps(asdict(replace(self, repeat=1, notes="")), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    def lay_out(self, folder: Path) -> Trajectory:
        """Return the trajectory; tables and functions are looked for in ``folder``.

        Raises
        ------
        TrajectoryError
            It is unknown, or takes no such parameters.
        """
        trajectory = self._one_round(folder)
        return trajectory if self.rounds == 1 else repeated(trajectory, self.rounds)

    def _one_round(self, folder: Path) -> Trajectory:
        if self.trajectory in STANDARD:
            return self._retraction()
        speed = replace(STANDARD_SPEED, linear=_either(self.speed_m_s, STANDARD_SPEED.linear))
        if self.trajectory.endswith(".csv"):
            self._takes("speed_m_s", "settle_s", "measure_s")
            return read_table(folder / self.trajectory, speed, self._dwell(Dwell()))
        file, _, function = self.trajectory.rpartition(":")
        if file.endswith(".py"):
            self._takes("speed_m_s", "settle_s", "measure_s", "holds_s", "steps", "return_steps")
            path = load_function(folder / file, function)
            steps, back = _either(self.steps, 10), _either(self.return_steps, 5)
            return lay_out(function, path, steps, back, speed, self._dwell(Dwell()))
        self._takes()
        if self.trajectory not in NAMED:
            raise TrajectoryError(
                f"trajectory {self.trajectory!r} is unknown; name one of {', '.join(NAMED)}, a table such as "
                "mine.csv, or a function such as mine.py:spiral"
            )
        return NAMED[self.trajectory]()

    def _retraction(self) -> Trajectory:
        standard = STANDARD[self.trajectory]
        return replace(
            standard,
            steps=_either(self.steps, standard.steps),
            step_length=_either(self.step_length_m, standard.step_length),
            angle=_either(self.angle_rad, standard.angle),
            return_steps=_either(self.return_steps, standard.return_steps),
            speed=Speed(_either(self.speed_m_s, standard.speed.linear), standard.speed.angular),
            dwell=self._dwell(standard.dwell),
        ).trajectory()

    def _dwell(self, usual: Dwell) -> Dwell:
        return Dwell(
            usual.rest_s,
            _either(self.settle_s, usual.settle_s),
            _either(self.measure_s, usual.measure_s),
            self.holds_s,
        )

    def _takes(self, *allowed: str) -> None:
        """Refuse a parameter that the trajectory would not heed."""
        usual = Trial(self.trajectory)
        always = ("trajectory", "repeat", "rounds", "notes")
        for name, value in asdict(self).items():
            if name not in (*always, *allowed) and value != getattr(usual, name):
                raise TrajectoryError(
                    f"trajectory {self.trajectory!r} takes no {name}; it takes {', '.join(allowed) or 'none'}"
                )


def _either(given: T | None, usual: T) -> T:
    return usual if given is None else given
