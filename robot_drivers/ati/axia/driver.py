"""Driver of an ATI Ethernet Axia: RDT stream over UDP, configuration over HTTP. It never biases by itself."""

from dataclasses import replace

from robot_drivers.ati.axia.configuration import AxiaConfiguration, read_configuration, set_rdt_rate
from robot_drivers.ati.axia.settings import AxiaSettings
from robot_drivers.ati.netft.receiver import LinkStatistics
from robot_drivers.ati.netft.stream import RdtStream, RecordMeaning, address_of
from robot_drivers.ati.netft.web import WebPages
from robot_drivers.ati.transducer.status import AXIA, StatusMap
from robot_drivers.errors import ConfigurationError, DeviceError
from robot_drivers.protocols import DeviceIdentity, StreamStatistics, WrenchBlock


class Axia:
    """A :class:`~robot_drivers.protocols.ForceSensor` with its electronics in it.

    ``read`` belongs to one thread; ``set_bias`` may be called from another.

    Raises
    ------
    DeviceUnreachableError, DeviceProtocolError, ConfigurationError
        From ``connect``: the sensor does not answer, cannot be understood, or is set so that it cannot be used.
    """

    def __init__(self, settings: AxiaSettings) -> None:
        self._settings = settings
        self._web = WebPages(
            settings.host, settings.http_port, settings.answer_timeout_s, settings.request_pause_s
        )
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
        settings = self._settings
        address = address_of(settings.host)
        configuration = read_configuration(self._web)
        if settings.rate_hz is not None and configuration.rdt_rate_hz != settings.rate_hz:
            set_rdt_rate(self._web, settings.rate_hz)
            configuration = replace(configuration, rdt_rate_hz=settings.rate_hz)
        meaning = self._meaning(configuration)
        self.close()
        self._identity = self._describe(configuration, meaning)
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
        """Return the counts of this stream; ``restarts`` also counts those by :meth:`set_bias`."""
        return self._stream.statistics() if self._stream is not None else StreamStatistics()

    def link_statistics(self) -> LinkStatistics:
        """Return what the network did since the stream started."""
        return self._started().link_statistics()

    def describe_status(self, status: int) -> tuple[str, ...]:
        """Return one line for each bit set in a status word."""
        return AXIA.describe(status)

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

    def _meaning(self, configuration: AxiaConfiguration) -> RecordMeaning:
        settings = self._settings
        if configuration.rdt_enabled is False:
            raise ConfigurationError(
                f"RDT is off on the force sensor {settings.host}: enable it on its Communications page"
            )
        sample_rate_hz = settings.sample_rate_hz or configuration.sample_rate_hz
        if sample_rate_hz is None:
            raise ConfigurationError(
                f"the force sensor {settings.host} does not tell at what rate it samples: set sample_rate_hz to that "
                "of its ADC Settings page"
            )
        rdt_rate_hz = configuration.rdt_rate_hz
        if rdt_rate_hz is not None and rdt_rate_hz > sample_rate_hz:
            raise ConfigurationError(
                f"the force sensor {settings.host} samples {sample_rate_hz:g} times and sends {rdt_rate_hz} records a "
                "second, so that some come twice: set rate_hz to at most the first, or sample faster on its ADC "
                "Settings page"
            )
        rated_wrench = settings.rated_wrench or configuration.rated_wrench
        if rated_wrench is None:
            raise ConfigurationError(
                f"the force sensor {settings.host} does not tell its range: set rated_wrench to that of its certificate"
            )
        return RecordMeaning(
            configuration.scaling.si_per_count,
            rated_wrench,
            self._status_map(),
            sample_rate_hz,
            configuration.datagram_period_s(settings.mode),
        )

    def _status_map(self) -> StatusMap:
        usable = self._settings.usable_status
        return AXIA if usable is None else replace(AXIA, usable_words=usable)

    def _describe(self, configuration: AxiaConfiguration, meaning: RecordMeaning) -> DeviceIdentity:
        scaling = configuration.scaling
        told = {
            "units": f"{scaling.force_unit}, {scaling.torque_unit}",
            "counts per unit": f"{scaling.counts_per_force:g}, {scaling.counts_per_torque:g}",
            "calibration": f"{configuration.calibration}: {configuration.part_number}",
            "rated wrench": ", ".join(f"{rated:g}" for rated in meaning.rated_wrench),
            "sample rate": f"{meaning.ticks_per_s:g} Hz",
            "RDT rate": f"{configuration.rdt_rate_hz} Hz",
            "RDT mode": self._settings.mode,
            "low-pass filter": f"{configuration.low_pass}",
            "software bias": configuration.bias,
        }
        return DeviceIdentity(
            kind="force sensor",
            model=configuration.product or f"ATI Ethernet Axia {configuration.part_number}".rstrip(),
            serial=configuration.serial,
            address=f"{self._settings.host}:{self._settings.rdt_port}",
            details={name: words for name, words in told.items() if words and "None" not in words},
        )

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
