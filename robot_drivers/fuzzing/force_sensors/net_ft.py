"""Fuzz targets: the Net F/T box - stream, sequence accounting, command interface, configuration page."""

import struct
from random import Random
from xml.dom import expatbuilder
from xml.dom.minidom import Element, Text

import numpy as np

from robot_drivers.ati.netft.command_interface import parse_calibration, parse_reading, parse_write_answer
from robot_drivers.ati.netft.configuration import read_configuration
from robot_drivers.ati.rdt import protocol as rdt
from robot_drivers.ati.rdt.sequence import SequenceTracker
from robot_drivers.ati.rdt.web import WebPages, parse_tags
from robot_drivers.errors import ConfigurationError, DeviceFaultError, DeviceProtocolError
from robot_drivers.fuzzing.mutations import disturbed, mutated, overwritten
from robot_drivers.fuzzing.target import Target, WrongValueError, agree

_RECORD = struct.Struct(">III6i")
_READING = bytes.fromhex("1234 0000 0064 FF38 0100 0001 FFFF 7FFF")
_CALIBRATION = bytes.fromhex("1234 02 03 000F4240 000F4240" + "0FA0" * 6)
_WRITE_ANSWER = bytes.fromhex("1234 02 00")
_GOLDEN_RECORD = bytes.fromhex("0000000100000007 00000000 000F4240FFE17B80003567E0 00000064FFFFFF38FFFFFFFF")

_PAGE = b"""<?xml version="1.0" encoding="UTF-8"?>
<netft>
  <prodname>Net F/T</prodname>
  <runft>1;-2;3;4;5;-6</runft>
  <setcfgsel>0</setcfgsel>
  <cfgnam>Gamma SI-130-10 &amp; tool</cfgnam>
  <cfgcpf>1000000</cfgcpf>
  <cfgcpt>999.999</cfgcpt>
  <scfgfu>N</scfgfu>
  <scfgtu>N-mm</scfgtu>
  <cfgmr>130;130;400;10;10;10</cfgmr>
  <comrdte>Enabled</comrdte>
  <comrdtrate>7000</comrdtrate>
  <comrdtbsiz>40</comrdtbsiz>
</netft>
"""
_AXIA_PAGE = (
    b"<netFTApi><prodname>Ethernet Axia</prodname><setcfgsel>0</setcfgsel><cfgcpf>1e6</cfgcpf><cfgcpt>1000000</cfgcpt>"
    b"<scfgfu>lbf</scfgfu><scfgtu>Nm</scfgtu></netFTApi>"
)
_STREAM_LENGTHS = ((80, 120), (30, 50), (2, 12))
"""Each shorter than the one before: a stream whose beginning is lost must not look like the end of the former one."""

_TRUTHFUL = ("cfgcpf", "cfgcpt", "scfgfu", "scfgtu")


def _records(random: Random) -> bytes:
    seeds = [b"".join(_record(k, 7 * k, [k, -k, k, 1, 2, 3]) for k in range(1, 1 + n)) for n in (1, 3, 40)]
    return mutated(random, [_GOLDEN_RECORD, *seeds])


def _check_records(payload: bytes) -> bool:
    records = rdt.decode(payload)
    expected = list(_RECORD.iter_unpack(payload))
    columns = (records.rdt_sequence, records.ft_sequence, records.status)
    found = [
        (*map(int, head), *map(int, counts))
        for *head, counts in zip(
            *(column.tolist() for column in columns), records.counts.tolist(), strict=True
        )
    ]
    agree(found, expected, "RDT records")
    return bool(expected)


def _stream(random: Random) -> list[list[bytes]]:
    """Return the datagrams of one to three streams; counts tell stream and position of each record."""
    tick = random.choice((2**32 - 50, random.randrange(2**32)))
    ticks = random.choice((1, 7, 14, 7000))
    sessions = []
    for session in range(random.choice((1, 1, 2, 3))):
        records = []
        for k in range(1, random.randrange(*_STREAM_LENGTHS[session])):
            records.append(_record(k, tick % 2**32, [session, k, 0x5A5A5A5, -session, -k, ~0x5A5A5A5]))
            tick += ticks
        sessions.append(disturbed(random, records))
        # the last: powered up again. One that had been up for about as long before could not be told
        tick = random.choice((tick, tick + 7000, tick + 2**31 + random.randrange(2**20)))
    return sessions


def _check_stream(sessions: list[list[bytes]]) -> bool:
    """Every record delivered is a true one, once, and counters differ as positions in the stream do."""
    tracker, delivered = SequenceTracker(), 0
    counters: set[int] = set()
    for number, session in enumerate(sessions):
        tracker.expect_start()
        offsets = set()
        payload = b"".join(datagram for datagram in session if len(datagram) in rdt.DATAGRAM_SIZES)
        records = rdt.decode(payload)
        split = len(records.rdt_sequence) // 2
        stamps = np.full(len(records.rdt_sequence), 10**9 * number)
        for part in (slice(None, split), slice(split, None)):
            placed = tracker.place(records.rdt_sequence[part], records.ft_sequence[part], stamps[part])
            for index, counter in zip(placed.index.tolist(), placed.counter.tolist(), strict=True):
                counts = records.counts[part][index].tolist()
                truth = [number, k := counts[1], 0x5A5A5A5, -number, -k, ~0x5A5A5A5]
                agree(counts, truth, f"record delivered as number {counter}")
                if counter in counters:
                    raise WrongValueError(f"number {counter} was delivered twice")
                counters.add(counter)
                offsets.add(counter - k)
                delivered += 1
        if len(offsets) > 1:
            raise WrongValueError(f"stream {number}: records were moved against each other, by {offsets}")
    agree(tracker.statistics.received, delivered, "count of received records")
    return delivered > 0


def _check_reading(answer: bytes) -> bool:
    reading = parse_reading(answer)
    agree(struct.pack(">HH6h", 0x1234, reading.status >> 16, *reading.counts16), answer, "READFT")
    return True


def _check_calibration(answer: bytes) -> bool:
    told = parse_calibration(answer)
    scaling = told.scaling
    codes = [
        ["lbf", "N", "klbf", "kN", "kgf", "gf"].index(scaling.force_unit) + 1,
        ["lbf-in", "lbf-ft", "N-m", "N-mm", "kgf-cm", "kN-m"].index(scaling.torque_unit) + 1,
    ]
    counts = (int(scaling.counts_per_force), int(scaling.counts_per_torque))
    agree(struct.pack(">HBBII6H", 0x1234, *codes, *counts, *told.scale_factors), answer, "READCALINFO")
    if 0 in counts or 0 in told.scale_factors:
        raise WrongValueError("a factor of 0 was taken for good")
    return True


def _check_write_answer(answer: bytes) -> bool:
    parse_write_answer(answer)
    agree(answer, _WRITE_ANSWER, "answer to WRITETRANSFORM")
    return True


class _OnePage(WebPages):
    """A box whose every page is the same."""

    def __init__(self, content: bytes) -> None:
        self._content = content

    def page(self, path: str) -> bytes:
        """Return the page, whatever was asked for."""
        return self._content


def _page(random: Random) -> bytes:
    return (mutated if random.random() < 0.5 else overwritten)(random, [_PAGE, _AXIA_PAGE])


def _check_page(page: bytes) -> bool:
    """What is taken is well-formed for another reader of XML as well, and says the same."""
    tags = parse_tags(page, ("netft", "netFTApi"))
    document = expatbuilder.parseString(page, namespaces=False)  # the box knows none
    elements = [e for e in document.getElementsByTagName("*") if e is not document.documentElement]
    leaves = {e.tagName: _text(e).strip() for e in elements if not e.getElementsByTagName("*")}
    agree(dict(tags), leaves, "configuration page")
    scaling = read_configuration(_OnePage(page)).scaling
    read = (scaling.counts_per_force, scaling.counts_per_torque, scaling.force_unit, scaling.torque_unit)
    force, torque, *units = (leaves[tag] for tag in _TRUTHFUL)
    agree(read, (float(force), float(torque), *units), "scaling of the page")
    if not (np.isfinite(scaling.si_per_count).all() and (scaling.si_per_count > 0).all()):
        raise WrongValueError(f"scaling {scaling} was taken for good")
    return True


def _text(element: Element) -> str:
    return "".join(node.data for node in element.childNodes if isinstance(node, Text))


def _record(rdt_sequence: int, ft_sequence: int, counts: list[int]) -> bytes:
    return _RECORD.pack(rdt_sequence, ft_sequence, 0, *counts)


TARGETS = (
    Target("rdt-records", "each field as struct reads it", _records, _check_records),
    Target("rdt-stream", "each record carries its place in the stream", _stream, _check_stream),
    Target(
        "command-reading",
        "encoded again, the same bytes",
        lambda random: mutated(random, [_READING]),
        _check_reading,
    ),
    Target(
        "command-calibration",
        "encoded again, the same bytes",
        lambda random: (mutated if random.random() < 0.5 else overwritten)(random, [_CALIBRATION]),
        _check_calibration,
    ),
    Target(
        "command-write-answer",
        "only the four bytes that say so are success",
        lambda random: mutated(random, [_WRITE_ANSWER]),
        _check_write_answer,
        (DeviceProtocolError, DeviceFaultError),
    ),
    Target(
        "web-configuration",
        "a document tree has the same tags; factors positive and finite",
        _page,
        _check_page,
        (DeviceProtocolError, ConfigurationError),
    ),
)
