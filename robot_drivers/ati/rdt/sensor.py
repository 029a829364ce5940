"""Driver of a force/torque sensor on RDT: stream over UDP, configuration over HTTP. It never biases by itself.

Units and factors are read from the sensor, never assumed.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from robot_drivers.ati.rdt.configuration import RdtConfiguration, set_rdt_rate
from robot_drivers.ati.rdt.receiver import LinkStatistics
from robot_drivers.ati.rdt.settings import RdtSettings
from robot_drivers.ati.rdt.stream import RdtStream, RecordMeaning, address_of
from robot_drivers.ati.rdt.web import WebPages
from robot_drivers.ati.transducer.status import StatusMap
from robot_drivers.errors import ConfigurationError, DeviceError
from robot_drivers.protocols import DeviceIdentity, StreamStatistics, WrenchBlock

Settings = TypeVar("Settings", bound=RdtSettings)


@dataclass(frozen=True, slots=True)
class RdtProduct(Generic[Settings]):
    """What differs between the products that speak RDT.

    Attributes
    ----------
    model : its name, where its pages tell none
    status_map : meaning of its status word, as long as it has not told more
    read : what a sensor is set to, of its settings and pages
    meaning : what its records mean, of its settings and what it is set to; raises ConfigurationError where it is set
        so that it cannot be used
    """

    model: str
    status_map: StatusMap
    read: Callable[[Settings, WebPages], RdtConfiguration]
    meaning: Callable[[Settings, RdtConfiguration], RecordMeaning]


class RdtSensor(Generic[Settings]):
    """A :class:`~robot_drivers.protocols.ForceSensor` of some product.

    ``read`` belongs to one thread; ``set_bias`` may be called from another.

    Raises
    ------
    DeviceUnreachableError, DeviceProtocolError, ConfigurationError
        From ``connect``: the sensor does not answer, cannot be understood, or is set so that it cannot be used.
    """

    def __init__(self, settings: Settings, product: RdtProduct[Settings]) -> None:
        self._settings = settings
        self._product = product
        self._web = WebPages(
            settings.host, settings.http_port, settings.answer_timeout_s, settings.request_pause_s
        )
        self._status_map = product.status_map
        self._identity: DeviceIdentity | None = None
        self._stream: RdtStream | None = None

    @property
    def identity(self) -> DeviceIdentity:
        """Who the sensor is; known once connected."""
        if self._identity is None:
            raise self._not_connected()
        return self._identity

    def connect(self) -> None:
        """Read what the sensor is set to, and set the RDT rate where one is wanted. Nothing is biased."""
        settings, product = self._settings, self._product
        address = address_of(settings.host)
        configuration = product.read(settings, self._web)
        if settings.rate_hz is not None and configuration.rdt_rate_hz != settings.rate_hz:
            set_rdt_rate(self._web, settings.rate_hz, settings.FASTEST_RDT_HZ)
            configuration = replace(configuration, rdt_rate_hz=settings.rate_hz)
        if configuration.rdt_enabled is False:
            raise ConfigurationError(
                f"RDT is off on the force sensor {settings.host}: enable it on its Communications page"
            )
        meaning = product.meaning(settings, configuration)
        self.close()
        self._status_map = meaning.status_map
        self._identity = DeviceIdentity(
            kind="force sensor",
            model=configuration.product or f"{product.model} {configuration.part_number}".rstrip(),
            serial=configuration.serial,
            address=f"{settings.host}:{settings.rdt_port}",
            details=_details(configuration, meaning, settings.mode),
        )
        self._stream = RdtStream(settings, address, meaning)

    def start(self) -> None:
        """Begin streaming and wait for the first record.

        Raises
        ------
        DeviceTimeoutError
            No record came.
        """
        self._connected().start()

    def read(self, timeout_s: float) -> WrenchBlock:
        """Return everything that arrived since the last call; wait up to ``timeout_s`` for a first sample."""
        return self._started().read(timeout_s)

    def statistics(self) -> StreamStatistics:
        """Return the counts of this stream; ``restarts`` also counts those by :meth:`set_bias`.

        ``malformed`` are datagrams of a wrong length and records that fit no stream.
        """
        return self._stream.statistics() if self._stream is not None else StreamStatistics()

    def link_statistics(self) -> LinkStatistics:
        """Return what the network did since the stream started."""
        return self._started().link_statistics()

    def describe_status(self, status: int) -> tuple[str, ...]:
        """Return one line for each bit set in a status word."""
        return self._status_map.describe(status)

    def set_bias(self) -> None:
        """Make the sensor subtract the present load from now on; see :meth:`RdtStream.set_bias`."""
        self._connected().set_bias()

    def stop(self) -> None:
        """Stop streaming; what has arrived can still be read."""
        if self._stream is not None:
            self._stream.stop()

    def close(self) -> None:
        """Stop streaming and release the socket."""
        if self._stream is not None:
            self._stream.close()

    def _connected(self) -> RdtStream:
        if self._stream is None:
            raise self._not_connected()
        return self._stream

    def _started(self) -> RdtStream:
        if self._stream is None:
            raise DeviceError(f"force sensor {self._settings.host} was not started: call start() first")
        return self._stream

    def _not_connected(self) -> DeviceError:
        return DeviceError(f"force sensor {self._settings.host} is not connected: call connect() first")


def _details(configuration: RdtConfiguration, meaning: RecordMeaning, mode: str) -> dict[str, str]:
    """Return what the sensor told and how it is read, in words; what it did not tell is left out."""
    scaling = configuration.scaling
    details = {
        "units": f"{scaling.force_unit}, {scaling.torque_unit}",
        "counts per unit": f"{scaling.counts_per_force:g}, {scaling.counts_per_torque:g}",
        "status map": meaning.status_map.product,
        "rated wrench": ", ".join(f"{rated:g}" for rated in meaning.rated_wrench),
        "sample rate": f"{meaning.ticks_per_s:g} Hz",
        "RDT mode": mode,
    }
    if configuration.index is not None:
        details["configuration"] = f"{configuration.index}: {configuration.name}"
    if configuration.part_number:
        details["calibration"] = f"{configuration.calibration}: {configuration.part_number}"
    if configuration.rdt_rate_hz is not None:
        details["RDT rate"] = f"{configuration.rdt_rate_hz} Hz"
    if configuration.low_pass is not None:
        details["low-pass filter"] = f"{configuration.low_pass}"
    if configuration.bias:
        details["software bias"] = configuration.bias
    return details
