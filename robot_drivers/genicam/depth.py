"""The depth of a GenICam camera: its components switched on, and what the counts mean read from its registers.

Source: GenICam Standard Features Naming Convention 2.7, chapters "Image Format Control" (components) and "3D Scan
Control".
"""

from collections.abc import Mapping
from ctypes import byref, c_size_t
from dataclasses import dataclass
from math import isfinite
from typing import Any, Self

from robot_drivers.errors import ConfigurationError, DeviceFaultError
from robot_drivers.genicam.aravis_library import AravisLibrary
from robot_drivers.genicam.parts import Part
from robot_drivers.protocols import DepthScale

_FORMAT = "Coord3D_C16"
_ALONG_AXIS = ("CalibratedC", "RectifiedC")
_UNITS_M: Mapping[str, float] = {"Millimeter": 1e-3, "Inch": 0.0254}
_LARGEST_COUNT = 0xFFFF


def parts_of(library: AravisLibrary, buffer: int) -> list[Part]:
    """Return what a buffer of Aravis tells of its parts."""
    size, parts = c_size_t(), []
    for number in range(library.plain("arv_buffer_get_n_parts", buffer)):
        library.plain("arv_buffer_get_part_data", buffer, number, byref(size))
        component, pixel_format, width, height = (
            int(library.plain(f"arv_buffer_get_part_{name}", buffer, number))
            for name in ("component_id", "pixel_format", "width", "height")
        )
        parts.append(Part(component, pixel_format, width, height, size.value))
    return parts


@dataclass(frozen=True, slots=True)
class DepthComponent:
    """What a camera tells of its depth images.

    Attributes
    ----------
    scale : what their counts mean
    focal_length_px, principal_point_px : of the image as it says; None where it does not
    """

    scale: DepthScale
    focal_length_px: float | None
    principal_point_px: tuple[float, float] | None

    @classmethod
    def switched_on(cls, library: AravisLibrary, camera: int, name: str) -> Self:
        """Switch on that each block holds an image and one of depth, and read what the counts mean.

        Raises
        ------
        ConfigurationError
            The camera has no such components, or its depth is not one along the optical axis.
        """
        features = _Features(library, camera)
        try:
            if library.plain("arv_camera_is_gv_device", camera):
                # Aravis takes the number of parts for that of the packet where the two share a field of 24 bits
                if features.has("GevGVSPExtendedIDMode"):
                    features.choose("GevGVSPExtendedIDMode", "On")
                features.enable("ArvGevSCCFGMultipart")
            for component in ("Range", "Intensity"):  # the last stays selected
                features.choose("ComponentSelector", component)
                features.enable("ComponentEnable")
                if component == "Range":
                    _check(features, name)
            return cls(_scale(features, name), *_projection(features))
        except DeviceFaultError as error:
            raise ConfigurationError(
                f"camera {name} sends no image with one of depth in two parts ({error}): leave depth out"
            ) from error

    def details(self) -> dict[str, str]:
        """Return the same as text."""
        invalid = "none" if self.scale.invalid is None else str(self.scale.invalid)
        told = {
            "depth": f"{self.scale.scale_m:g} m a count from {self.scale.offset_m:g} m, invalid {invalid}"
        }
        if self.focal_length_px is not None:
            told["focal_length_px"] = f"{self.focal_length_px:g}"
        if self.principal_point_px is not None:
            told["principal_point_px"] = " ".join(f"{value:g}" for value in self.principal_point_px)
        return told


class _Features:
    """Features of a camera by their standard names; what it lacks raises DeviceFaultError."""

    def __init__(self, library: AravisLibrary, camera: int) -> None:
        self._library, self._camera = library, camera

    def has(self, feature: str) -> bool:
        return bool(self._call("is_feature_available", feature))

    def choose(self, feature: str, entry: str) -> None:
        self._call("set_string", feature, entry.encode())

    def enable(self, feature: str) -> None:
        if not self._call("get_boolean", feature):
            self._call("set_boolean", feature, 1)

    def is_on(self, feature: str) -> bool:
        return self.has(feature) and bool(self._call("get_boolean", feature))

    def text(self, feature: str, usual: str) -> str:
        if not self.has(feature):
            return usual
        return self._library.text("arv_camera_get_string", self._camera, feature.encode())

    def number(self, feature: str) -> float:
        return float(self._call("get_float", feature))

    def _call(self, function: str, feature: str, *arguments: object) -> Any:
        return self._library.call(f"arv_camera_{function}", self._camera, feature.encode(), *arguments)


def _check(features: _Features, name: str) -> None:
    """Refuse depth of another kind than that along the optical axis."""
    told = features.text("PixelFormat", _FORMAT)
    if told != _FORMAT:
        raise ConfigurationError(
            f"camera {name} sends depth as {told}, not {_FORMAT}: set it with its maker's program"
        )
    mode = features.text("Scan3dOutputMode", _ALONG_AXIS[0])
    if mode not in _ALONG_AXIS:
        raise ConfigurationError(
            f"camera {name} sends {mode}, which is no depth along the optical axis: set Scan3dOutputMode to "
            f"{' or '.join(_ALONG_AXIS)} with its maker's program"
        )
    system = features.text("Scan3dCoordinateSystem", "Cartesian")
    if system != "Cartesian":
        raise ConfigurationError(
            f"camera {name} counts depth in a {system} system: set Scan3dCoordinateSystem to Cartesian with its "
            "maker's program"
        )
    unit = features.text("Scan3dDistanceUnit", "Millimeter")
    if unit not in _UNITS_M:
        raise ConfigurationError(
            f"camera {name} counts depth in {unit}: set Scan3dDistanceUnit to {' or '.join(_UNITS_M)} with its "
            "maker's program"
        )


def _scale(features: _Features, name: str) -> DepthScale:
    if features.has("Scan3dCoordinateSelector"):
        features.choose("Scan3dCoordinateSelector", "CoordinateC")
    unit_m = _UNITS_M[features.text("Scan3dDistanceUnit", "Millimeter")]
    offset = features.number("Scan3dCoordinateOffset") if features.has("Scan3dCoordinateOffset") else 0.0
    invalid = None
    if features.is_on("Scan3dInvalidDataFlag"):
        told = round(features.number("Scan3dInvalidDataValue"))
        invalid = told if 0 <= told <= _LARGEST_COUNT else None
    scale = features.number("Scan3dCoordinateScale")
    if not (isfinite(scale) and isfinite(offset) and scale > 0):
        raise ConfigurationError(
            f"camera {name} counts depth by {scale:g} from {offset:g}, which is no scale: set "
            "Scan3dCoordinateScale and Scan3dCoordinateOffset with its maker's program"
        )
    return DepthScale(scale * unit_m, offset * unit_m, invalid)


def _projection(features: _Features) -> tuple[float | None, tuple[float, float] | None]:
    focal = features.number("Scan3dFocalLength") if features.has("Scan3dFocalLength") else None
    points = ("Scan3dPrincipalPointU", "Scan3dPrincipalPointV")
    if not all(map(features.has, points)):
        return focal, None
    u, v = map(features.number, points)
    return focal, (u, v)
