"""Drive a force sensor of your own: one that sends a line of six numbers, in N and N·m, over TCP.

A package that declares ``DRIVER`` as entry point ``line_sensor`` of the group ``retract.force_sensors`` makes it known
to rig files::

    [force_sensor]
    driver = "line_sensor"

    [force_sensor.settings]
    port = 49200

Run as a script, it reads from a sensor that the script itself plays.
"""

import socket
import threading
import time
from dataclasses import dataclass

import numpy as np

from robot_drivers.clock import host_time_ns
from robot_drivers.driver import Driver
from robot_drivers.errors import ConfigurationError, DeviceFaultError, DeviceUnreachableError
from robot_drivers.protocols import DeviceIdentity, FloatArray, ForceSensor, StreamStatistics, WrenchBlock


@dataclass(frozen=True, slots=True)
class LineSensorSettings:
    """The keys of ``[force_sensor.settings]``."""

    port: int
    host: str = "127.0.0.1"
    rate_hz: float = 100.0
    connect_timeout_s: float = 2.0

    def __post_init__(self) -> None:
        if not 0 < self.port < 65536:
            raise ValueError(f"port must be between 1 and 65535, not {self.port}")
        if not self.rate_hz > 0:
            raise ValueError(f"rate_hz must be positive, not {self.rate_hz}")


@dataclass
class LineSensor:
    """The sensor; every line is one sample, which the host stamps as it arrives."""

    settings: LineSensorSettings
    _socket: socket.socket | None = None
    _rest: bytes = b""
    _received: int = 0
    _malformed: int = 0

    @property
    def identity(self) -> DeviceIdentity:
        """Who the device is."""
        address = f"{self.settings.host}:{self.settings.port}"
        return DeviceIdentity("force sensor", "line sensor", "1", address)

    def connect(self) -> None:
        """Open the connection."""
        try:
            self._socket = socket.create_connection(
                (self.settings.host, self.settings.port), self.settings.connect_timeout_s
            )
        except OSError as error:
            raise DeviceUnreachableError(f"{self.identity.address}: {error}; is the sensor on?") from error

    def start(self) -> None:
        """Do nothing: it sends by itself."""

    def read(self, timeout_s: float) -> WrenchBlock:
        """Return the samples that have arrived, waiting up to ``timeout_s`` for a first one."""
        if self._socket is None:
            raise ConfigurationError(f"{self.identity.address}: read before connect")
        *lines, self._rest = (self._rest + self._arrived(self._socket, timeout_s)).split(b"\n")
        samples = [sample for line in lines if (sample := self._sample(line)) is not None]
        counter = self._received + np.arange(len(samples))
        self._received += len(samples)
        return WrenchBlock(
            counter=counter,
            # it has no clock but its rate
            device_time_s=counter / self.settings.rate_hz,
            host_time_ns=np.full(len(samples), host_time_ns()),
            status=np.zeros(len(samples), dtype=np.int64),
            usable=np.ones(len(samples), dtype=np.bool_),
            wrench=np.array(samples, dtype=np.float64).reshape(-1, 6),
        )

    def statistics(self) -> StreamStatistics:
        """Return the counts since the stream started."""
        return StreamStatistics(received=self._received, malformed=self._malformed)

    def stop(self) -> None:
        """Do nothing: it goes on sending."""

    def close(self) -> None:
        """Close the connection."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _arrived(self, connection: socket.socket, timeout_s: float) -> bytes:
        connection.settimeout(timeout_s)
        try:
            arrived = connection.recv(65536)
        except TimeoutError:
            return b""
        if not arrived:
            raise DeviceFaultError(f"{self.identity.address}: the sensor has closed the connection")
        return arrived

    def _sample(self, line: bytes) -> list[float] | None:
        try:
            values = [float(text) for text in line.split()]
        except ValueError:
            values = []
        if len(values) == 6 and np.isfinite(values).all():
            return values
        self._malformed += 1
        return None


DRIVER = Driver(LineSensorSettings, LineSensor)


def play(listener: socket.socket, samples: int, rate_hz: float) -> None:
    """Be the sensor: send a pull of 1 N along x to whoever connects, and wait until they hang up."""
    connection, _ = listener.accept()
    with connection:
        for _ in range(samples):
            connection.sendall(b"1.0 0.0 0.0 0.0 0.0 0.0\n")
            time.sleep(1.0 / rate_hz)
        connection.recv(1)


def main(samples: int = 200) -> FloatArray:
    """Read so many samples of a sensor that is played, print what came, and return the mean wrench (6,), N and N·m."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        settings = LineSensorSettings(listener.getsockname()[1])
        player = threading.Thread(target=play, args=(listener, samples, settings.rate_hz))
        player.start()
        sensor: ForceSensor = DRIVER.make(settings)
        sensor.connect()
        sensor.start()
        blocks = []
        while sensor.statistics().received < samples:
            blocks.append(sensor.read(timeout_s=1.0).wrench)
        print(f"{sensor.identity.model} at {sensor.identity.address}: {sensor.statistics()}")
        sensor.close()
        player.join()
    mean = np.concatenate(blocks).mean(axis=0)
    print(f"mean wrench: {mean}")
    return np.asarray(mean)


if __name__ == "__main__":
    main()
