"""Bags of other programs, small ones, in both storages; what damages them, and who reads them."""

import sqlite3
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np

from daq.bad_input.damage.any_file import BINARY, TEXT, Damage
from daq.bad_input.kind import Kind
from daq.bad_input.samples.sessions import Extent, cut_session
from daq.bags.reading import read_bag
from daq.export.ros2_bag import write_ros2_bag
from daq.progress import silent
from daq.recording.mcap.schemas import WRENCH
from daq.recording.messages.rows import message_rows, wrench_layout
from daq.recording.reader import open_recording
from estimator.importing.proposal_text import text_of
from estimator.importing.proposing import propose
from robot_drivers.clock import host_time_ns

_TABLES = """
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL);
CREATE TABLE messages(
  id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL
);
CREATE TABLE message_definitions(
  id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL, encoded_message_definition TEXT NOT NULL
);
"""
_MESSAGES = 40


def _mcap(folder: Path) -> None:
    cut_session(folder, Extent(samples=_MESSAGES, samples_in_chunk=20, images=0))
    write_ros2_bag(open_recording(folder / "session"), folder / "bag", silent)


def _sqlite(folder: Path) -> None:
    time_ns = host_time_ns() + np.arange(_MESSAGES) * 10_000_000
    bodies = message_rows(0, wrench_layout("sensor"), time_ns)["message_body"]
    rows = [(1, stamp, body.tobytes()) for stamp, body in zip(time_ns.tolist(), bodies, strict=True)]
    with closing(sqlite3.connect(folder / "bag.db3")) as store, store:
        store.executescript(_TABLES)
        store.execute("INSERT INTO topics VALUES (1, '/ft', ?, 'cdr')", (WRENCH.name,))
        store.execute(
            "INSERT INTO message_definitions VALUES (1, ?, ?, ?)", (WRENCH.name, WRENCH.encoding, WRENCH.text)
        )
        store.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", rows)


def _understood(bag: Path) -> str:
    return text_of(propose(read_bag(bag)), Path("trial"))


def _kind(name: str, damages: dict[str, Sequence[Damage]], bag: str) -> Kind:
    write = _mcap if bag == "bag" else _sqlite
    return Kind(f"import, {name}", write, damages, read=lambda folder: _understood(folder / bag))


KINDS: tuple[Kind, ...] = (
    _kind("rosbag2", {"bag/*.mcap": BINARY, "bag/metadata.yaml": TEXT}, "bag"),
    _kind("SQLite3", {"bag.db3": BINARY}, "bag.db3"),
)
