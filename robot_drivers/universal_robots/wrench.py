"""The force/torque sensor in the flange of an e-Series arm as a :class:`robot_drivers.protocols.ForceSensor`.

It reads ``ft_raw_wrench``, which knows neither payload nor zero: nothing is biased, and nothing taken off. Software
from 5.9 on tells it.
"""

import contextlib
from dataclasses import dataclass

import numpy as np

from robot_drivers.errors import ConfigurationError, DeviceError
from robot_drivers.protocols import DeviceIdentity, StreamStatistics, WrenchBlock
from robot_drivers.setting_checks import check_positive
from robot_drivers.universal_robots.arms import RATED_WRENCH, Arm
from robot_drivers.universal_robots.robot.registers import SAFETY_NORMAL, SAFETY_REDUCED
from robot_drivers.universal_robots.rtde.connection import RTDEConnection
from robot_drivers.universal_robots.rtde.stream import TIMESTAMP, RTDEStream, Sample

_WRENCH, _SAFETY = "ft_raw_wrench", "safety_mode"


@dataclass(frozen=True, slots=True)
class URWrenchSettings:
    """How to reach and use the sensor.

    Attributes
    ----------
    host, port : of the controller
    arm : which arm it is, which tells the sensor's range
    rate_hz : of its samples, 500 at most
    silence_limit_s : without a sample for so long, the controller counts as lost
    connect_timeout_s : longest wait for an answer
    serial : of the arm, for the record; RTDE does not tell it
    """

    host: str
    port: int = 30004
    arm: Arm = "UR5e"
    rate_hz: float = 500.0
    silence_limit_s: float = 0.25
    connect_timeout_s: float = 3.0
    serial: str = "not told"

    def __post_init__(self) -> None:
        if not 10 <= self.rate_hz <= 500:
            raise ConfigurationError(f"UR rate_hz {self.rate_hz}: must be 10 to 500")
        check_positive(self, "UR", "silence_limit_s", "connect_timeout_s")


class URWrench:
    """One sensor, over a connection of its own: it streams beside a robot that is moved over another."""

    def __init__(self, settings: URWrenchSettings) -> None:
        self._settings = settings
        self._rated = np.array(RATED_WRENCH[settings.arm])
        self._connection: RTDEConnection | None = None
        self._stream: RTDEStream | None = None
        self._streams = False

    @property
    def identity(self) -> DeviceIdentity:
        """Who it is."""
        connection, settings = self._connected(), self._settings
        return DeviceIdentity(
            kind="force sensor",
            model=f"flange of a Universal Robots {settings.arm}",
            serial=settings.serial,
            address=f"{settings.host}:{settings.port}",
            details={"software": connection.version, "units": "N, N·m", "rate": f"{settings.rate_hz:g} Hz"},
        )

    def connect(self) -> None:
        """Find the controller.

        Raises
        ------
        DeviceUnreachableError, DeviceTimeoutError, DeviceProtocolError
            It is not there, does not answer, or speaks something else.
        """
        self.close()
        settings = self._settings
        self._connection = RTDEConnection(settings.host, settings.port, settings.connect_timeout_s)

    def start(self) -> None:
        """Begin to stream, with counters and counts from 0; does nothing while it streams.

        Raises
        ------
        DeviceError
            The controller does not know the variable, or tells nothing.
        """
        self._connected()
        if self._streams:
            return
        # a connection that has streamed is not asked anew: its data would come between the answers
        self.connect()
        settings, connection = self._settings, self._connected()
        recipe = connection.outputs((TIMESTAMP, _WRENCH, _SAFETY), settings.rate_hz)
        connection.start()
        with contextlib.ExitStack() as opened:
            stream = RTDEStream(connection, recipe, settings.rate_hz, settings.silence_limit_s)
            opened.callback(stream.close)
            stream.wait_for_first(settings.connect_timeout_s)
            opened.pop_all()
        self._stream, self._streams = stream, True

    def read(self, timeout_s: float) -> WrenchBlock:
        """Return the samples that arrived since the last call; wait up to ``timeout_s`` for a first one."""
        if self._stream is None:
            raise DeviceError(f"force sensor {self._settings.host}: does not stream; call start() first")
        samples = self._stream.take(timeout_s)
        wrench = np.array([sample.values[_WRENCH] for sample in samples], dtype=np.float64).reshape(-1, 6)
        return WrenchBlock(
            counter=np.array([sample.counter for sample in samples], dtype=np.int64),
            device_time_s=np.array([sample.device_time_s for sample in samples], dtype=np.float64),
            host_time_ns=np.array([sample.host_time_ns for sample in samples], dtype=np.int64),
            status=np.array([_status(sample) for sample in samples], dtype=np.int64),
            usable=np.all(np.abs(wrench) <= self._rated, axis=1),
            wrench=wrench,
        )

    def statistics(self) -> StreamStatistics:
        """Return the counts since the stream started."""
        return StreamStatistics() if self._stream is None else self._stream.statistics()

    def stop(self) -> None:
        """End streaming; what has arrived can still be read."""
        if self._stream is not None and self._streams:
            self._streams = False
            self._stream.close()
            self._connected().close()

    def close(self) -> None:
        """Disconnect."""
        stream, self._stream, self._streams = self._stream, None, False
        connection, self._connection = self._connection, None
        if stream is not None:
            stream.close()
        if connection is not None:
            connection.close()

    def _connected(self) -> RTDEConnection:
        if self._connection is None:
            raise DeviceError(f"force sensor {self._settings.host}: not connected; call connect() first")
        return self._connection


def _status(sample: Sample) -> int:
    """Return 0 while the controller is in its normal or reduced safety mode, else that mode."""
    mode = sample.values[_SAFETY]
    assert not isinstance(mode, tuple)  # by its type, INT32
    return 0 if mode in (SAFETY_NORMAL, SAFETY_REDUCED) else int(mode)
