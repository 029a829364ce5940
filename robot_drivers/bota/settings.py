"""How to reach and use a Bota Systems sensor on a serial line."""

from dataclasses import dataclass

from robot_drivers.errors import ConfigurationError
from robot_drivers.setting_checks import check_positive, check_rated_wrench
from robot_drivers.specification import Six

BIT_RATES = (9600, 57600, 115200, 230400, 460800)
BITS_PER_FRAME = 10 * 37  # start, 8 data, stop


@dataclass(frozen=True, slots=True, kw_only=True)
class BotaSettings:
    """How to reach and use one sensor. It streams by itself: nothing is ever sent to it.

    Attributes
    ----------
    port : name of the port (``/dev/ttyUSB0``, ``COM3``) or a URL of pyserial
    bit_rate : that the sensor is set to; 460800 in the manufacturer's examples
    rate_hz : samples a second that its filter gives; None measures it at connection by the sensor's own clock
    rated_wrench : ± N and N·m beyond which a sample is not usable, by the data sheet of the model; None leaves it to
        the sensor, which tells where it is out of range
    model, serial : for the record; the stream tells neither
    start_timeout_s : longest wait for frames
    batch_s : time between two looks at the line, by which receive stamps can be late
    """

    port: str
    bit_rate: int = 460800
    rate_hz: float | None = None
    rated_wrench: Six | None = None
    model: str = "Bota Systems, serial"
    serial: str = "not told"
    start_timeout_s: float = 2.0
    batch_s: float = 0.002

    def __post_init__(self) -> None:
        if self.bit_rate not in BIT_RATES:
            raise ConfigurationError(
                f"force sensor bit_rate {self.bit_rate}: must be one of {', '.join(map(str, BIT_RATES))}"
            )
        check_positive(self, "force sensor", "rate_hz", "start_timeout_s", "batch_s")
        if self.rate_hz is not None and self.rate_hz * BITS_PER_FRAME > self.bit_rate:
            raise ConfigurationError(
                f"force sensor rate_hz {self.rate_hz}: at {self.bit_rate} bit/s at most "
                f"{self.bit_rate / BITS_PER_FRAME:.0f} frames fit in a second"
            )
        check_rated_wrench(self.rated_wrench)
