"""The GenICam description of the emulated camera: standard features (SFNC) upon its registers."""

from robot_drivers.genicam.emulator.settings import PIXEL_FORMATS, GigECameraSettings

WIDTH, HEIGHT, PIXEL_FORMAT, PAYLOAD_SIZE = 0x8000, 0x8004, 0x8008, 0x800C
ACQUISITION_MODE, ACQUISITION_START, ACQUISITION_STOP = 0x8010, 0x8014, 0x8018
CHUNK_MODE, CHUNK_SELECTOR, CHUNK_ENABLE = 0x801C, 0x8020, 0x8024
PTP_ENABLE, PTP_STATUS, PTP_OFFSET, FRAME_RATE = 0x8028, 0x802C, 0x8030, 0x8038
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
    features = "".join(f"<pFeature>{name}</pFeature>" for name in nodes)
    head = _HEAD.format(vendor=settings.vendor, model=settings.model, features=features)
    return "\n".join([head, *nodes.values(), '<Port Name="Device"/>', "</RegisterDescription>"]).encode()


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
