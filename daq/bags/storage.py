"""What a file of a bag holds, whatever its format: topics, and the messages of each with the times of their receipt."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from robot_drivers.protocols import IntArray


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic as the bag declares it.

    Attributes
    ----------
    name : of the topic
    type_name : of its messages, such as ``geometry_msgs/msg/WrenchStamped``
    encoding : of its messages, such as ``cdr``
    definition_format : ``ros2msg``, ``ros2idl`` or ``ros1msg``; empty where the bag does not define the type
    definition : of the type, with those that it depends on
    """

    name: str
    type_name: str
    encoding: str
    definition_format: str = ""
    definition: str = ""


@dataclass(frozen=True, slots=True)
class Messages:
    """Messages of one topic: when the recorder received them (n,), ns, and their bytes."""

    log_time_ns: IntArray
    data: Sequence[bytes | memoryview]


class Storage(Protocol):
    """One file of a bag."""

    @property
    def topics(self) -> tuple[Topic, ...]:
        """What is in the file."""

    @property
    def faults(self) -> tuple[str, ...]:
        """What is wrong with the file, a line each; complete once every topic was read."""

    def read(self, topic: Topic) -> Messages:
        """Return the messages of a topic, in the order of the file."""

    def close(self) -> None:
        """Close the file; what was read of it may be used no longer."""
