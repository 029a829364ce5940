"""What was lost during a session, in words: on the way from a device, and on the way to the file."""

from collections.abc import Mapping

from daq.devices import Devices
from daq.recording.recorder import Recorder
from robot_drivers.protocols import StreamStatistics


def statistics(devices: Devices) -> dict[str, StreamStatistics]:
    """Return what each device counts of its messages, by its role."""
    return {role: device.statistics() for role, device in devices.all().items()}


def losses_between(
    before: Mapping[str, StreamStatistics], after: Mapping[str, StreamStatistics]
) -> list[str]:
    """Return a line for everything that befell the messages of a device meanwhile: they are counted from connecting."""
    told = []
    for role, count in after.items():
        words = {
            "samples lost on the way": count.lost - before[role].lost,
            "messages not understood and left out": count.malformed - before[role].malformed,
            "times its stream or its clock began anew": count.restarts - before[role].restarts,
        }
        told += [f"{role}: {number} {what}" for what, number in words.items() if number > 0]
    return told


def drops(recorder: Recorder) -> list[str]:
    """Return a line for every stream of which samples were received but not written."""
    return [f"{name}: {count} samples not written" for name, count in recorder.dropped().items()]
