"""Aravis through ctypes: the functions that the driver uses, with its errors as exceptions.

Arguments are those of the public headers of Aravis 0.8 (``arvcamera.h``, ``arvstream.h``, ``arvbuffer.h``,
``arvchunkparser.h``), which all 0.8.x share; those of images in parts came with 0.8.26.
"""

import ctypes
from ctypes import POINTER, c_char_p, c_double, c_int, c_int64, c_size_t, c_uint32, c_uint64, c_void_p
from typing import Any

from robot_drivers.cameras.shared_library import Need, SharedLibrary, Signature
from robot_drivers.errors import DeviceFaultError

BUFFER_SUCCESS = 0

_GOBJECT = "libgobject-2.0.so.0"


class _Error(ctypes.Structure):
    """``GError``."""

    _fields_ = (("domain", c_uint32), ("code", c_int), ("message", c_char_p))


_ERROR = POINTER(_Error)
_PLAIN: dict[str, Signature] = {
    "arv_camera_is_gv_device": (c_int, (c_void_p,)),
    "arv_camera_create_chunk_parser": (c_void_p, (c_void_p,)),
    "arv_buffer_new": (c_void_p, (c_size_t, c_void_p)),
    "arv_buffer_get_status": (c_int, (c_void_p,)),
    "arv_buffer_get_data": (c_void_p, (c_void_p, POINTER(c_size_t))),
    "arv_buffer_get_frame_id": (c_uint64, (c_void_p,)),
    "arv_buffer_get_timestamp": (c_uint64, (c_void_p,)),
    "arv_buffer_get_system_timestamp": (c_uint64, (c_void_p,)),
    "arv_buffer_get_image_width": (c_int, (c_void_p,)),
    "arv_buffer_get_image_height": (c_int, (c_void_p,)),
    "arv_stream_push_buffer": (None, (c_void_p, c_void_p)),
    "arv_stream_timeout_pop_buffer": (c_void_p, (c_void_p, c_uint64)),
}
_OF_PARTS: dict[str, Signature] = {
    "arv_buffer_get_n_parts": (c_uint32, (c_void_p,)),
    "arv_buffer_get_part_component_id": (c_uint32, (c_void_p, c_uint32)),
    "arv_buffer_get_part_pixel_format": (c_uint32, (c_void_p, c_uint32)),
    "arv_buffer_get_part_width": (c_int, (c_void_p, c_uint32)),
    "arv_buffer_get_part_height": (c_int, (c_void_p, c_uint32)),
    "arv_buffer_get_part_data": (c_void_p, (c_void_p, c_uint32, POINTER(c_size_t))),
}
_CHECKED: dict[str, Signature] = {
    "arv_camera_new": (c_void_p, (c_char_p,)),
    "arv_camera_get_vendor_name": (c_char_p, (c_void_p,)),
    "arv_camera_get_model_name": (c_char_p, (c_void_p,)),
    "arv_camera_get_device_serial_number": (c_char_p, (c_void_p,)),
    "arv_camera_get_pixel_format_as_string": (c_char_p, (c_void_p,)),
    "arv_camera_get_region": (None, (c_void_p, *(POINTER(c_int),) * 4)),
    "arv_camera_get_frame_rate": (c_double, (c_void_p,)),
    "arv_camera_get_payload": (c_uint32, (c_void_p,)),
    "arv_camera_is_feature_available": (c_int, (c_void_p, c_char_p)),
    "arv_camera_set_boolean": (None, (c_void_p, c_char_p, c_int)),
    "arv_camera_get_boolean": (c_int, (c_void_p, c_char_p)),
    "arv_camera_get_string": (c_char_p, (c_void_p, c_char_p)),
    "arv_camera_set_string": (None, (c_void_p, c_char_p, c_char_p)),
    "arv_camera_get_float": (c_double, (c_void_p, c_char_p)),
    "arv_camera_set_chunks": (None, (c_void_p, c_char_p)),
    "arv_camera_gv_set_packet_size": (None, (c_void_p, c_int)),
    "arv_camera_create_stream": (c_void_p, (c_void_p, c_void_p, c_void_p)),
    "arv_camera_start_acquisition": (None, (c_void_p,)),
    "arv_camera_stop_acquisition": (None, (c_void_p,)),
    "arv_chunk_parser_get_integer_value": (c_int64, (c_void_p, c_void_p, c_char_p)),
}
_OF_GOBJECT: dict[str, Signature] = {
    "g_object_unref": (None, (c_void_p,)),
    "g_error_free": (None, (_ERROR,)),
}
_NEED = Need("GenICam", "Aravis 0.8", "libaravis-0.8-0")
_NEED_OF_PARTS = Need("GenICam", "Aravis 0.8.26 or newer for depth", "libaravis-0.8-0")


class AravisLibrary(SharedLibrary):
    """The loaded library.

    Parameters
    ----------
    name : of the shared library, or its path
    parts : whether images in parts are to be read

    Raises
    ------
    ConfigurationError
        There is no such library, or it is too old.
    """

    def __init__(self, name: str, *, parts: bool = False) -> None:
        checked = {
            function: (result, (*arguments, POINTER(_ERROR)))
            for function, (result, arguments) in _CHECKED.items()
        }
        super().__init__(name, _NEED, _PLAIN | checked)
        if parts:
            self.declare(_OF_PARTS, _NEED_OF_PARTS)
        self._gobject = SharedLibrary(_GOBJECT, _NEED, _OF_GOBJECT)

    def call(self, function: str, *arguments: Any) -> Any:
        """Call a function that reports errors.

        Raises
        ------
        DeviceFaultError
            With the library's own words for the error.
        """
        error = _ERROR()
        result = self.plain(function, *arguments, ctypes.byref(error))
        if error:
            words = (error.contents.message or b"unknown error").decode(errors="replace")
            self._gobject.plain("g_error_free", error)
            raise DeviceFaultError(f"{function.removeprefix('arv_')}: {words}")
        return result

    def text(self, function: str, *arguments: Any) -> str:
        """Call a function that gives text and reports errors, as :meth:`call`."""
        return (self.call(function, *arguments) or b"").decode(errors="replace")

    def release(self, thing: int) -> None:
        """Give a camera, stream, parser or buffer back."""
        self._gobject.plain("g_object_unref", thing)
