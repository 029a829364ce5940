"""The error tree of the device drivers.

    DeviceError
    ├── DeviceUnreachableError   nothing answers (also ConnectionError)
    ├── DeviceTimeoutError       it answered before and has stopped (also TimeoutError)
    ├── DeviceProtocolError      it answers, but not what the protocol says (also ValueError)
    ├── DeviceFaultError         it reports a fault of its own
    ├── ConfigurationError       the request or the settings cannot be right (also ValueError)
    └── MotionRefusedError       a motion was not started because a limit forbids it

Every message says what happened, with which device and value, and what to do next.
"""


class DeviceError(Exception):
    """Base of everything that a driver raises on purpose."""


class DeviceUnreachableError(DeviceError, ConnectionError):
    """No device answers at the given address."""


class DeviceTimeoutError(DeviceError, TimeoutError):
    """A connected device fell silent."""


class DeviceProtocolError(DeviceError, ValueError):
    """Bytes arrived that the protocol does not allow."""


class DeviceFaultError(DeviceError):
    """The device reports a fault of its own."""


class ConfigurationError(DeviceError, ValueError):
    """A setting or a request that cannot be right, found before anything was sent."""


class MotionRefusedError(DeviceError):
    """A motion that a limit forbids; nothing has moved."""
