"""What all force sensors on a CAN bus share; the devices differ in how they are asked for a sample."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import can

from robot_drivers.ati.can.link import Answer, CanLink, open_bus
from robot_drivers.ati.can.poller import Poller, Sample
from robot_drivers.errors import DeviceError
from robot_drivers.protocols import DeviceIdentity, StreamStatistics, WrenchBlock
from robot_drivers.setting_checks import check_positive


@dataclass(frozen=True, slots=True, kw_only=True)
class CanSettings:
    """How to reach and poll a device on a CAN bus.

    Attributes
    ----------
    channel, interface : of python-can, e.g. ``"can0"`` and ``"socketcan"``
    bitrate : bit/s; on socketcan the system sets it
    rate_hz : rate of polling
    answer_timeout_s : longest wait for an answer
    """

    channel: str
    bitrate: int
    interface: str = "socketcan"
    rate_hz: float = 500.0
    answer_timeout_s: float = 0.05

    def __post_init__(self) -> None:
        check_positive(self, "force sensor", "bitrate", "rate_hz", "answer_timeout_s")


class SampleDecoder(Protocol):
    """Turns the samples of one stream into blocks, in their order."""

    @property
    def repeated(self) -> int:
        """Samples that were delivered before, by the device's own number; 0 where it has none."""

    @property
    def restarts(self) -> int:
        """How often the device was powered up anew, as far as its number tells."""

    def block(self, samples: Sequence[Sample]) -> WrenchBlock:
        """Return the samples in SI; those that were delivered before are left out."""


class CanDevice(Protocol):
    """A device that has been met on an open bus."""

    @property
    def identity(self) -> DeviceIdentity:
        """Who it is."""

    def poll(self) -> Answer:
        """Ask for one sample."""

    def recover(self) -> None:
        """Make the device fit for use again after a silence, in which it may have been reset."""

    def begin(self) -> SampleDecoder:
        """Return what decodes the stream that begins now."""


D = TypeVar("D", bound=CanDevice)


class CanForceSensor(Generic[D]):
    """A :class:`~robot_drivers.protocols.ForceSensor` on a CAN bus, polled from ``start`` to ``stop``.

    Parameters
    ----------
    settings : how to reach the device
    name : what to call the device in messages
    meet : learns over the link what device there is

    Raises
    ------
    DeviceUnreachableError, DeviceTimeoutError, DeviceProtocolError, DeviceFaultError, ConfigurationError
        From ``connect``: there is no such bus, no device answers, or it is not fit for use. ``read`` raises the
        first when the bus fails and the third when the device could not be recovered after a silence; a silent
        device gives empty blocks.
    """

    def __init__(self, settings: CanSettings, name: str, meet: Callable[[CanLink], D]) -> None:
        self._settings = settings
        self._name = name
        self._meet = meet
        self._bus: can.BusABC | None = None
        self._link: CanLink | None = None
        self._device: D | None = None
        self._poller: Poller | None = None
        self._decoder: SampleDecoder | None = None

    @property
    def identity(self) -> DeviceIdentity:
        """Who the sensor is; known once connected."""
        return self._connected().identity

    def connect(self) -> None:
        """Open the bus and learn who is there. Nothing is biased."""
        self.close()
        settings = self._settings
        with contextlib.ExitStack() as on_failure:
            bus = open_bus(settings.interface, settings.channel, settings.bitrate)
            on_failure.callback(bus.shutdown)
            link = CanLink(bus, self._name, settings.answer_timeout_s)
            self._device = self._meet(link)
            on_failure.pop_all()
        self._bus, self._link = bus, link

    def start(self) -> None:
        """Begin polling."""
        device, link = self._connected(), self._link
        self.stop()
        if link is not None:
            link.malformed = 0
        self._decoder = device.begin()
        self._poller = Poller(device.poll, device.recover, self._settings.rate_hz)

    def read(self, timeout_s: float) -> WrenchBlock:
        """Return everything that arrived since the last call; wait up to ``timeout_s`` for a first sample."""
        if self._poller is None or self._decoder is None:
            raise DeviceError(f"{self._name} was not started: call start() first")
        return self._decoder.block(self._poller.take(timeout_s))

    def statistics(self) -> StreamStatistics:
        """Return the counts of this stream; a request without a whole answer is a lost sample."""
        if self._poller is None or self._decoder is None or self._link is None:
            return StreamStatistics()
        repeated = self._decoder.repeated
        return StreamStatistics(
            received=self._poller.received - repeated,
            lost=self._poller.lost,
            duplicated=repeated,
            restarts=self._decoder.restarts,
            malformed=self._link.malformed,
        )

    def stop(self) -> None:
        """End polling; what has arrived can still be read."""
        if self._poller is not None:
            self._poller.stop()

    def close(self) -> None:
        """End polling and leave the bus."""
        self.stop()
        self._poller = self._decoder = self._device = self._link = None
        if self._bus is not None:
            self._bus.shutdown()
            self._bus = None

    def _connected(self) -> D:
        if self._device is None:
            raise DeviceError(f"{self._name} is not connected: call connect() first")
        return self._device
