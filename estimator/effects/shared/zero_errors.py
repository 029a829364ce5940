"""How large an error of the force sensor's zero usually is."""

from estimator.effects.effect import Amplitude
from estimator.effects.shared.axes import WRENCH_CHANNELS

_UNITS = 3 * ["N"] + 3 * ["N·m"]
_SCALES = 3 * [0.1] + 3 * [0.004]
_SMALLEST = 3 * [0.01] + 3 * [0.0005]


def zero_error(name: str, channel: str) -> Amplitude:
    """Return the amplitude of an error of one channel's zero, N or N·m, called by a name and the channel.

    Examples
    --------
    >>> zero_error("bias", "tz")
    Amplitude(name='bias_tz', unit='N·m', scale=0.004, smallest=0.0005, lower=-inf, upper=inf)
    """
    place = WRENCH_CHANNELS.index(channel)
    return Amplitude(f"{name}_{channel}", _UNITS[place], _SCALES[place], _SMALLEST[place])
