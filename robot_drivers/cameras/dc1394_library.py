"""libdc1394 through ctypes: the structures and functions that the driver uses, with its errors as exceptions.

Layouts and numbers are those of the public headers of libdc1394 2.2 (``dc1394/*.h``), which all 2.x share.
"""

import ctypes
from ctypes import POINTER, c_char_p, c_float, c_int, c_int32, c_uint16, c_uint32, c_uint64, c_void_p
from typing import Any

from robot_drivers.cameras.shared_library import Need, SharedLibrary, Signature
from robot_drivers.errors import DeviceFaultError

FORMAT7_0 = 88
CODING_MONO8, CODING_RAW8 = 352, 361
FILTER_RGGB, FILTER_GBRG, FILTER_GRBG, FILTER_BGGR = range(512, 516)
OPERATION_1394B = 481
ISO_SPEEDS = {400: 2, 800: 3}
CAPTURE_POLL = 673
CAPTURE_FLAGS_DEFAULT = 4
FEATURE_SHUTTER, FEATURE_GAIN, FEATURE_FRAME_RATE = 423, 424, 431
FEATURE_MODE_MANUAL = 736
ON, OFF = 1, 0
RECOMMENDED_PACKET = -3

_SUCCESS = 0


class CameraId(ctypes.Structure):
    """``dc1394camera_id_t``."""

    _fields_ = (("unit", c_uint16), ("guid", c_uint64))


class CameraList(ctypes.Structure):
    """``dc1394camera_list_t``."""

    _fields_ = (("num", c_uint32), ("ids", POINTER(CameraId)))


class CameraStruct(ctypes.Structure):
    """``dc1394camera_t``; the library makes them, so what follows the last field used here is left out."""

    _fields_ = (
        ("guid", c_uint64),
        ("unit", c_int),
        ("unit_spec_ID", c_uint32),
        ("unit_sw_version", c_uint32),
        ("unit_sub_sw_version", c_uint32),
        ("command_registers_base", c_uint32),
        ("unit_directory", c_uint32),
        ("unit_dependent_directory", c_uint32),
        ("advanced_features_csr", c_uint64),
        ("PIO_control_csr", c_uint64),
        ("SIO_control_csr", c_uint64),
        ("strobe_control_csr", c_uint64),
        ("format7_csr", c_uint64 * 8),
        ("iidc_version", c_int),
        ("vendor", c_char_p),
        ("model", c_char_p),
        ("vendor_id", c_uint32),
        ("model_id", c_uint32),
        ("bmode_capable", c_int),
    )


class VideoFrame(ctypes.Structure):
    """``dc1394video_frame_t``."""

    _fields_ = (
        ("image", POINTER(ctypes.c_uint8)),
        ("size", c_uint32 * 2),
        ("position", c_uint32 * 2),
        ("color_coding", c_int),
        ("color_filter", c_int),
        ("yuv_byte_order", c_uint32),
        ("data_depth", c_uint32),
        ("stride", c_uint32),
        ("video_mode", c_int),
        ("total_bytes", c_uint64),
        ("image_bytes", c_uint32),
        ("padding_bytes", c_uint32),
        ("packet_size", c_uint32),
        ("packets_per_frame", c_uint32),
        ("timestamp", c_uint64),
        ("frames_behind", c_uint32),
        ("camera", POINTER(CameraStruct)),
        ("id", c_uint32),
        ("allocated_image_bytes", c_uint64),
        ("little_endian", c_int),
        ("data_in_padding", c_int),
    )


_CAMERA = POINTER(CameraStruct)
_ERROR = c_int
_PLAIN: dict[str, Signature] = {
    "dc1394_new": (c_void_p, ()),
    "dc1394_free": (None, (c_void_p,)),
    "dc1394_camera_free_list": (None, (POINTER(CameraList),)),
    "dc1394_camera_new": (_CAMERA, (c_void_p, c_uint64)),
    "dc1394_camera_free": (None, (_CAMERA,)),
    "dc1394_capture_get_fileno": (c_int, (_CAMERA,)),
    "dc1394_capture_is_frame_corrupt": (c_int, (_CAMERA, POINTER(VideoFrame))),
    "dc1394_error_get_string": (c_char_p, (c_int,)),
}
_CHECKED: dict[str, tuple[Any, ...]] = {
    "dc1394_camera_enumerate": (c_void_p, POINTER(POINTER(CameraList))),
    "dc1394_read_cycle_timer": (_CAMERA, POINTER(c_uint32), POINTER(c_uint64)),
    "dc1394_video_set_operation_mode": (_CAMERA, c_int),
    "dc1394_video_set_iso_speed": (_CAMERA, c_int),
    "dc1394_video_set_mode": (_CAMERA, c_int),
    "dc1394_video_set_transmission": (_CAMERA, c_int),
    "dc1394_format7_get_max_image_size": (_CAMERA, c_int, POINTER(c_uint32), POINTER(c_uint32)),
    "dc1394_format7_get_packet_parameters": (_CAMERA, c_int, POINTER(c_uint32), POINTER(c_uint32)),
    "dc1394_format7_get_color_filter": (_CAMERA, c_int, POINTER(c_int)),
    "dc1394_format7_set_roi": (_CAMERA, c_int, c_int, c_int32, c_int32, c_int32, c_int32, c_int32),
    "dc1394_feature_set_power": (_CAMERA, c_int, c_int),
    "dc1394_feature_set_mode": (_CAMERA, c_int, c_int),
    "dc1394_feature_set_absolute_control": (_CAMERA, c_int, c_int),
    "dc1394_feature_set_absolute_value": (_CAMERA, c_int, c_float),
    "dc1394_feature_get_absolute_value": (_CAMERA, c_int, POINTER(c_float)),
    "dc1394_set_control_registers": (_CAMERA, c_uint64, POINTER(c_uint32), c_uint32),
    "dc1394_get_control_registers": (_CAMERA, c_uint64, POINTER(c_uint32), c_uint32),
    "dc1394_capture_setup": (_CAMERA, c_uint32, c_uint32),
    "dc1394_capture_stop": (_CAMERA,),
    "dc1394_capture_dequeue": (_CAMERA, c_int, POINTER(POINTER(VideoFrame))),
    "dc1394_capture_enqueue": (_CAMERA, POINTER(VideoFrame)),
}
_NEED = Need("dc1394", "libdc1394", "libdc1394-25")


class DC1394Library(SharedLibrary):
    """The loaded library.

    Parameters
    ----------
    name : of the shared library, or its path

    Raises
    ------
    ConfigurationError
        There is no such library.
    """

    def __init__(self, name: str) -> None:
        checked = {function: (_ERROR, arguments) for function, arguments in _CHECKED.items()}
        super().__init__(name, _NEED, _PLAIN | checked)

    def call(self, function: str, *arguments: Any) -> None:
        """Call a function that returns an error code.

        Raises
        ------
        DeviceFaultError
            With the library's own words for the error.
        """
        code = self.plain(function, *arguments)
        if code != _SUCCESS:
            words = self.plain("dc1394_error_get_string", code) or b"unknown error"
            raise DeviceFaultError(f"{function}: {words.decode(errors='replace')} ({code})")
