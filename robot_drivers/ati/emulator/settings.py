"""What an emulated Net F/T box is like."""

from dataclasses import dataclass

import numpy as np

from robot_drivers.ati.transducer.gamma import GAGE_NOISE_STD
from robot_drivers.protocols import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxConfiguration:
    """One of the box's configurations.

    ``newtons`` and ``newton_metres`` are the sizes of its units, ``force_code`` and ``torque_code`` their
    codes on the command interface.
    """

    name: str = "Gamma SI-130-10"
    force_unit: str = "N"
    torque_unit: str = "N-m"
    newtons: float = 1.0
    newton_metres: float = 1.0
    force_code: int = 2
    torque_code: int = 3
    counts_per_force: float = 1e6
    counts_per_torque: float = 1e6

    @property
    def counts_per_si(self) -> FloatArray:
        """Counts per N and N·m, (6,)."""
        return np.repeat(
            [self.counts_per_force / self.newtons, self.counts_per_torque / self.newton_metres], 3
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class EmulatorSettings:
    """What the emulated box is like.

    Attributes
    ----------
    host, rdt_port, http_port, command_port : where it listens; port 0 takes a free one
    product, serial : what it tells about itself
    configurations, active_configuration : what it can be and is set to
    calibration_counts : counts per force and torque of the calibration, which ``netftcalapi.xml`` shows
    scale_factors : counts per 16-bit count on the command interface. Those of a real Gamma are not known;
        these let the rated range fit
    rdt_enabled, rate_hz, buffer_size : RDT settings at power-up
    internal_rate_hz : rate of ``ft_sequence`` on the device's own clock
    clock_ppm : how much faster than the host's that clock runs, 1e-6
    noise_std : standard deviation of the white noise, N and N·m
    seed : of noise and faults
    bias_stops_stream : whether a bias request ends the stream; real boxes are reported either way
    burst_s : records are produced and sent in bursts this long. The wrench source is evaluated for the newest
        record of each burst and interpolated linearly for the others
    min_request_interval_s : HTTP requests that follow each other faster are dropped without answer
    """

    host: str = "127.0.0.1"
    rdt_port: int = 0
    http_port: int = 0
    command_port: int = 0
    product: str = "Net F/T"
    serial: str = "FT33206"
    configurations: tuple[BoxConfiguration, ...] = (BoxConfiguration(),)
    active_configuration: int = 0
    calibration_counts: tuple[float, float] = (1e6, 1e6)
    scale_factors: tuple[int, int, int, int, int, int] = (4000, 4000, 12300, 400, 400, 400)
    rdt_enabled: bool = True
    rate_hz: int = 1000
    buffer_size: int = 10
    internal_rate_hz: int = 7000
    clock_ppm: float = 0.0
    noise_std: tuple[float, float, float, float, float, float] = GAGE_NOISE_STD
    seed: int = 0
    bias_stops_stream: bool = False
    burst_s: float = 0.004
    min_request_interval_s: float = 0.0
