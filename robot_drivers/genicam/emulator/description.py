"""The GenICam description of the emulated camera: standard features (SFNC) upon its registers."""

from robot_drivers.genicam.emulator.settings import (
    DEPTH_MODES,
    DEPTH_UNITS,
    PIXEL_FORMATS,
    GigECameraSettings,
    GigEDepthSettings,
)

WIDTH, HEIGHT, PIXEL_FORMAT, PAYLOAD_SIZE = 0x8000, 0x8004, 0x8008, 0x800C
ACQUISITION_MODE, ACQUISITION_START, ACQUISITION_STOP = 0x8010, 0x8014, 0x8018
CHUNK_MODE, CHUNK_SELECTOR, CHUNK_ENABLE = 0x801C, 0x8020, 0x8024
PTP_ENABLE, PTP_STATUS, PTP_OFFSET, FRAME_RATE = 0x8028, 0x802C, 0x8030, 0x8038
COMPONENT_SELECTOR, COMPONENT_ENABLE, EXTENDED_IDS = 0x8040, 0x8044, 0x8048
DEPTH_MODE, DEPTH_UNIT, COORDINATE_SELECTOR, INVALID_FLAG = 0x8080, 0x8084, 0x8088, 0x808C
_NUMBERS = {
    "Scan3dCoordinateScale": 0x8090,
    "Scan3dCoordinateOffset": 0x8098,
    "Scan3dInvalidDataValue": 0x80A0,
    "Scan3dFocalLength": 0x80A8,
    "Scan3dPrincipalPointU": 0x80B0,
    "Scan3dPrincipalPointV": 0x80B8,
}
COMPONENTS = {"Intensity": 1, "Range": 4}
TIMESTAMP_CHUNK = 0x00000102
IMAGE_CHUNK = 0x00000001
PTP_STATES = (
    *("Initializing", "Faulty", "Disabled", "Listening", "PreMaster", "Master", "Passive", "Uncalibrated"),
    "Slave",
)

_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<RegisterDescription ModelName="{model}" VendorName="{vendor}" StandardNameSpace="GEV" SchemaMajorVersion="1"
 SchemaMinorVersion="1" SchemaSubMinorVersion="0" MajorVersion="1" MinorVersion="0" SubMinorVersion="0"
 ProductGuid="00000000-0000-0000-0000-000000000001" VersionGuid="00000000-0000-0000-0000-000000000002"
 ToolTip="{model}" xmlns="http://www.genicam.org/GenApi/Version_1_1">
<Category Name="Root">{features}</Category>
"""


def description(settings: GigECameraSettings) -> bytes:
    """Return the description as XML."""
    nodes = {
        "Width": _integer("Width", WIDTH, "RO"),
        "Height": _integer("Height", HEIGHT, "RO"),
        "OffsetX": '<Integer Name="OffsetX"><Value>0</Value></Integer>',
        "OffsetY": '<Integer Name="OffsetY"><Value>0</Value></Integer>',
        "PixelFormat": _enumeration("PixelFormat", PIXEL_FORMAT, PIXEL_FORMATS, "RO"),
        "PayloadSize": _integer("PayloadSize", PAYLOAD_SIZE, "RO"),
        "AcquisitionMode": _enumeration("AcquisitionMode", ACQUISITION_MODE, {"Continuous": 0}, "RW"),
        "AcquisitionStart": _command("AcquisitionStart", ACQUISITION_START),
        "AcquisitionStop": _command("AcquisitionStop", ACQUISITION_STOP),
        "AcquisitionFrameRate": _float("AcquisitionFrameRate", FRAME_RATE),
        "DeviceVendorName": _text("DeviceVendorName", 0x48, 32),
        "DeviceModelName": _text("DeviceModelName", 0x68, 32),
        "DeviceSerialNumber": _text("DeviceSerialNumber", 0xD8, 16),
        "TLParamsLocked": '<Integer Name="TLParamsLocked"><Value>0</Value></Integer>',
    }
    if settings.chunks:
        nodes |= {
            "ChunkModeActive": _boolean("ChunkModeActive", CHUNK_MODE),
            "ChunkSelector": _enumeration(
                "ChunkSelector", CHUNK_SELECTOR, {"Image": 0, "Timestamp": 1}, "RW"
            ),
            "ChunkEnable": _boolean("ChunkEnable", CHUNK_ENABLE),
            "ChunkTimestamp": (
                '<Integer Name="ChunkTimestamp"><pValue>ChunkTimestampReg</pValue></Integer>'
                + _register("ChunkTimestampReg", 0, "RO", 8, "ChunkTimestampPort")
                + f'<Port Name="ChunkTimestampPort"><ChunkID>{TIMESTAMP_CHUNK:08x}</ChunkID></Port>'
            ),
        }
    if settings.ptp != "absent":
        states = {name: number for number, name in enumerate(PTP_STATES)}
        nodes |= {
            "PtpEnable": _boolean("PtpEnable", PTP_ENABLE),
            "PtpStatus": _enumeration("PtpStatus", PTP_STATUS, states, "RO"),
            "PtpOffsetFromMaster": (
                '<Integer Name="PtpOffsetFromMaster"><pValue>PtpOffsetReg</pValue></Integer>'
                + _register("PtpOffsetReg", PTP_OFFSET, "RO", 8, sign="Signed")
            ),
        }
    if settings.depth is not None:
        nodes |= _depth_nodes()
    features = "".join(f"<pFeature>{name}</pFeature>" for name in nodes)
    head = _HEAD.format(vendor=settings.vendor, model=settings.model, features=features)
    return "\n".join([head, *nodes.values(), '<Port Name="Device"/>', "</RegisterDescription>"]).encode()


def depth_registers(depth: GigEDepthSettings) -> dict[int, int]:
    """Return what the registers of 32 bits hold that tell of depth, by address."""
    return {
        COMPONENT_SELECTOR: COMPONENTS["Intensity"],
        EXTENDED_IDS: depth.extended_ids,
        DEPTH_MODE: DEPTH_MODES.index(depth.mode),
        DEPTH_UNIT: DEPTH_UNITS.index(depth.unit),
        COORDINATE_SELECTOR: 0,
        INVALID_FLAG: depth.invalid is not None,
    }


def depth_numbers(depth: GigEDepthSettings) -> dict[int, float]:
    """Return the numbers of 64 bits that tell of depth, by address."""
    values = (depth.scale, depth.offset, depth.invalid or 0, depth.focal_length_px, *depth.principal_point_px)
    return dict(zip(_NUMBERS.values(), map(float, values), strict=True))


def _depth_nodes() -> dict[str, str]:
    modes, units = (
        {name: number for number, name in enumerate(names)} for names in (DEPTH_MODES, DEPTH_UNITS)
    )
    axes = {"CoordinateA": 1, "CoordinateB": 2, "CoordinateC": 0}
    return {
        "ComponentSelector": _enumeration("ComponentSelector", COMPONENT_SELECTOR, COMPONENTS, "RW"),
        "ComponentEnable": _boolean("ComponentEnable", COMPONENT_ENABLE),
        "GevGVSPExtendedIDMode": _enumeration(
            "GevGVSPExtendedIDMode", EXTENDED_IDS, {"Off": 0, "On": 1}, "RW"
        ),
        "Scan3dOutputMode": _enumeration("Scan3dOutputMode", DEPTH_MODE, modes, "RO"),
        "Scan3dDistanceUnit": _enumeration("Scan3dDistanceUnit", DEPTH_UNIT, units, "RO"),
        "Scan3dCoordinateSelector": _enumeration("Scan3dCoordinateSelector", COORDINATE_SELECTOR, axes, "RW"),
        "Scan3dInvalidDataFlag": _boolean("Scan3dInvalidDataFlag", INVALID_FLAG),
        **{name: _float(name, address) for name, address in _NUMBERS.items()},
    }


def _register(
    name: str, address: int, access: str, size: int = 4, port: str = "Device", sign: str = "Unsigned"
) -> str:
    return (
        f'<IntReg Name="{name}"><Address>{address:#x}</Address><Length>{size}</Length><AccessMode>{access}</AccessMode>'
        f"<pPort>{port}</pPort><Cachable>NoCache</Cachable><Sign>{sign}</Sign><Endianess>BigEndian</Endianess></IntReg>"
    )


def _integer(name: str, address: int, access: str) -> str:
    return f'<Integer Name="{name}"><pValue>{name}Reg</pValue></Integer>' + _register(
        f"{name}Reg", address, access
    )


def _boolean(name: str, address: int) -> str:
    return (
        f'<Boolean Name="{name}"><pValue>{name}Reg</pValue><OnValue>1</OnValue><OffValue>0</OffValue></Boolean>'
        + _register(f"{name}Reg", address, "RW")
    )


def _command(name: str, address: int) -> str:
    return (
        f'<Command Name="{name}"><pValue>{name}Reg</pValue><CommandValue>1</CommandValue></Command>'
        + _register(f"{name}Reg", address, "RW")
    )


def _enumeration(name: str, address: int, entries: dict[str, int], access: str) -> str:
    told = "".join(
        f'<EnumEntry Name="{entry}"><Value>{value}</Value></EnumEntry>' for entry, value in entries.items()
    )
    return f'<Enumeration Name="{name}">{told}<pValue>{name}Reg</pValue></Enumeration>' + _register(
        f"{name}Reg", address, access
    )


def _float(name: str, address: int) -> str:
    return (
        f'<Float Name="{name}"><pValue>{name}Reg</pValue></Float><FloatReg Name="{name}Reg">'
        f"<Address>{address:#x}</Address><Length>8</Length><AccessMode>RO</AccessMode><pPort>Device</pPort>"
        "<Endianess>BigEndian</Endianess></FloatReg>"
    )


def _text(name: str, address: int, size: int) -> str:
    return (
        f'<StringReg Name="{name}"><Address>{address:#x}</Address><Length>{size}</Length>'
        "<AccessMode>RO</AccessMode><pPort>Device</pPort></StringReg>"
    )
