"""Driver of an ATI force/torque sensor behind a Net F/T box: RDT stream over UDP.

Units and factors are read from the box's active configuration, never assumed. The driver never biases by
itself.
"""

from dataclasses import replace

from robot_drivers.ati.netft import rdt
from robot_drivers.ati.netft.command_interface import CommandInterface
from robot_drivers.ati.netft.configuration import NetFTConfiguration, read_configuration, set_rdt_rate
from robot_drivers.ati.netft.receiver import LinkStatistics
from robot_drivers.ati.netft.settings import NetFTSettings
from robot_drivers.ati.netft.stream import RdtStream, RecordMeaning, address_of
from robot_drivers.ati.netft.web import WebPages
from robot_drivers.ati.transducer.status import STATUS_MAPS, StatusMap, status_map
from robot_drivers.errors import ConfigurationError, DeviceError
from robot_drivers.protocols import DeviceIdentity, StreamStatistics, WrenchBlock


class NetFT:
    """A :class:`~robot_drivers.protocols.ForceSensor` on Net F/T.

    ``read`` belongs to one thread; ``set_bias`` and ``reset_latch`` may be called from another.

    Raises
    ------
    DeviceUnreachableError, DeviceProtocolError, ConfigurationError
        From ``connect``: the box does not answer, cannot be understood, or is set so that it cannot be used.
    """

    def __init__(self, settings: NetFTSettings) -> None:
        self._settings = settings
        self._web = WebPages(
            settings.host, settings.http_port, settings.answer_timeout_s, settings.request_pause_s
        )
        self._configuration: NetFTConfiguration | None = None
        self._status_map = status_map("")
        self._stream: RdtStream | None = None

    @property
    def identity(self) -> DeviceIdentity:
        """Who the sensor is; known once connected."""
        configuration = self._configuration
        if configuration is None:
            raise self._not_connected()
        scaling = configuration.scaling
        details = {
            "units": f"{scaling.force_unit}, {scaling.torque_unit}",
            "counts per unit": f"{scaling.counts_per_force:g}, {scaling.counts_per_torque:g}",
            "status map": self._status_map.product,
            "RDT mode": self._settings.mode,
        }
        if configuration.index is not None:
            details["configuration"] = f"{configuration.index}: {configuration.name}"
        if configuration.rdt_rate_hz is not None:
            details["RDT rate"] = f"{configuration.rdt_rate_hz} Hz"
        return DeviceIdentity(
            kind="force sensor",
            model=configuration.product or "ATI Net F/T",
            serial=configuration.calibration_serial,
            address=f"{self._settings.host}:{self._settings.rdt_port}",
            details=details,
        )

    def connect(self) -> None:
        """Read what the box is set to, and set the RDT rate where one is wanted. Nothing is biased."""
        settings = self._settings
        address = address_of(settings.host)
        configuration = self._read_configuration()
        if settings.rate_hz is not None and configuration.rdt_rate_hz != settings.rate_hz:
            set_rdt_rate(self._web, settings.rate_hz)
            configuration = replace(configuration, rdt_rate_hz=settings.rate_hz)
        if configuration.rdt_enabled is False:
            raise ConfigurationError(
                f"RDT is off on the force sensor {settings.host}: enable it on its Communications page"
            )
        self.close()
        self._status_map = self._choose_status_map(configuration.product)
        self._configuration = configuration
        meaning = RecordMeaning(
            configuration.scaling.si_per_count,
            settings.rated_wrench,
            self._status_map,
            settings.internal_rate_hz,
            configuration.datagram_period_s(settings.mode),
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
        """Make the box subtract the present load from now on; see :meth:`RdtStream.set_bias`."""
        self._connected().set_bias()

    def reset_latch(self) -> None:
        """Clear the box's monitor-condition latch (not acknowledged)."""
        self._connected().send(rdt.Command.RESET_LATCH)

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

    def _read_configuration(self) -> NetFTConfiguration:
        settings = self._settings
        if settings.scaling_source == "web":
            return read_configuration(self._web, settings.configuration_index)
        with CommandInterface(settings.host, settings.command_port, settings.answer_timeout_s) as interface:
            return NetFTConfiguration(scaling=interface.read_calibration().scaling)

    def _choose_status_map(self, product: str) -> StatusMap:
        settings = self._settings
        chosen = STATUS_MAPS[settings.status_map] if settings.status_map else status_map(product)
        if settings.usable_status is None:
            return chosen
        return replace(chosen, usable_words=settings.usable_status)
