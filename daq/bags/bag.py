"""A bag as one thing: the files of a rosbag2 folder in their order, or a single file, compressed or not.

The folder's ``metadata.yaml`` names the files and counts the messages. Where it is missing or damaged, the files are
taken by their names. Format: ``rosbag2_storage/metadata_io.cpp`` and ``rosbag2_compression`` of ROS 2.
"""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import zstandard
from mcap.writer import MCAP0_MAGIC

from daq.bags.mcap_storage import McapStorage
from daq.bags.sqlite_storage import MAGIC as SQLITE_MAGIC
from daq.bags.sqlite_storage import SqliteStorage
from daq.bags.storage import Messages, Storage, Topic
from daq.errors import RecordingError
from daq.recording.foreign_bags import METADATA_FILE, METADATA_KEY, is_bag_folder
from estimator.errors import InputError
from estimator.importing.formats.dic_text import natural
from estimator.input_file import read_input_text, require_file

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_ROS1_MAGIC = b"#ROSBAG V"
_SUFFIXES = (".mcap", ".db3")
_MOST_BYTES_OF_A_MESSAGE = 500_000_000
_MOST_BYTES_OF_A_FILE = 50_000_000_000
_BLOCK = 2**24


@dataclass(slots=True)
class Bag:
    """An open bag.

    Attributes
    ----------
    how : what it is, in words
    told_counts : messages by topic, as the metadata tell; empty without any
    faults : what is wrong with it, a line each; complete once every topic was read
    """

    how: str
    storages: Sequence[Storage]
    told_counts: dict[str, int] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)

    @property
    def topics(self) -> list[Topic]:
        """The topics of all files, in their order."""
        return list(dict.fromkeys(topic for storage in self.storages for topic in storage.topics))

    def read(self, topic: Topic) -> Messages:
        """Return the messages of a topic from all files, in the order of their receipt, decompressed."""
        parts = [storage.read(topic) for storage in self.storages if topic in storage.topics]
        time_ns = np.concatenate([part.log_time_ns for part in parts])
        data = [body for part in parts for body in part.data]
        if any(bytes(body[:4]) == ZSTD_MAGIC for body in data[:1]):
            data = [_decompressed(body) for body in data]
        order = np.argsort(time_ns, kind="stable")
        return Messages(time_ns[order], [data[place] for place in order.tolist()])

    def all_faults(self, read: dict[str, int]) -> list[str]:
        """Return what is wrong with the bag, now that so many messages of each topic were read."""
        found = [*self.faults, *(fault for storage in self.storages for fault in storage.faults)]
        for name, told in self.told_counts.items():
            if read.get(name, 0) < told:
                found.append(f"{name}: {told - read.get(name, 0)} of {told} messages are missing")
        return found


def is_bag(path: Path) -> bool:
    """Tell whether a path is a bag, or a file of one, and not of any other format."""
    if path.is_dir():
        return is_bag_folder(path) or bool(_files_in(path))
    try:
        with path.open("rb") as file:
            head = file.read(len(SQLITE_MAGIC))
    except OSError:
        return False
    return (
        head.startswith((MCAP0_MAGIC, SQLITE_MAGIC, _ROS1_MAGIC))
        or path.name.removesuffix(".zstd").endswith(_SUFFIXES)
        or path.name == METADATA_FILE
    )


@contextmanager
def open_bag(path: Path) -> Iterator[Bag]:
    """Open a rosbag2 folder, or a file.

    Raises
    ------
    RecordingError, InputError
        It holds no file that can be read; one that cannot, beside others that can, is a fault of the bag.
    """
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(TemporaryDirectory()))
        if not path.is_dir():
            storage = _opened(path, scratch)
            stack.callback(storage.close)
            yield Bag("MCAP" if isinstance(storage, McapStorage) else "SQLite3", [storage])
            return
        told, faults = _metadata(path)
        storages: list[Storage] = []
        for file in _listed(path, told, faults):
            try:
                storages.append(_opened(file, scratch))
                stack.callback(storages[-1].close)
            except (RecordingError, InputError) as error:
                faults.append(str(error))
        if not storages:
            raise RecordingError(
                faults[0] if faults else f"{path}: holds no file of a bag; name another folder"
            )
        yield Bag("rosbag2", storages, _counts(told), faults)


def _opened(file: Path, scratch: Path) -> McapStorage | SqliteStorage:
    """Open a file by what it begins with."""
    require_file(file)
    with file.open("rb") as stream:
        head = stream.read(len(SQLITE_MAGIC))
    if head.startswith(ZSTD_MAGIC):
        file = _unpacked(file, scratch)
        with file.open("rb") as stream:
            head = stream.read(len(SQLITE_MAGIC))
    if head.startswith(_ROS1_MAGIC):
        raise RecordingError(
            f"{file}: is a bag of ROS 1; `rosbags-convert --src {file.name} --dst folder` makes a rosbag2 of it"
        )
    return SqliteStorage(file) if head == SQLITE_MAGIC else McapStorage(file)


def _unpacked(file: Path, scratch: Path) -> Path:
    """Return a file whose whole content is compressed by zstd, unpacked."""
    target = scratch / file.name.removesuffix(".zstd")
    try:
        with file.open("rb") as packed, target.open("wb") as plain:
            reader = zstandard.ZstdDecompressor().stream_reader(packed)
            while block := reader.read(_BLOCK):
                if plain.tell() > _MOST_BYTES_OF_A_FILE:
                    raise RecordingError(
                        f"{file}: unpacks to more than 50 GB; divide the bag, or unpack it yourself"
                    )
                plain.write(block)
    except zstandard.ZstdError as error:
        if not target.stat().st_size:
            raise RecordingError(f"{file}: cannot be unpacked ({error}); restore it from a copy") from None
    return target


def _decompressed(body: bytes | memoryview) -> bytes:
    """Return a message that was compressed by itself; nothing of one that is damaged."""
    try:
        return zstandard.ZstdDecompressor().decompress(bytes(body), max_output_size=_MOST_BYTES_OF_A_MESSAGE)
    except zstandard.ZstdError:
        return b""


def _metadata(folder: Path) -> tuple[dict[str, Any], list[str]]:
    """Return what ``metadata.yaml`` says, and what is wrong with it."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        content = YAML(typ="safe").load(read_input_text(folder / METADATA_FILE))
        told = content[METADATA_KEY]
    except (InputError, YAMLError, KeyError, TypeError, ValueError):
        return {}, [f"{METADATA_FILE} is missing or damaged; the files are read in the order of their names"]
    return (told, []) if isinstance(told, dict) else ({}, [f"{METADATA_FILE} is damaged"])


def _listed(folder: Path, told: dict[str, Any], faults: list[str]) -> list[Path]:
    """Return the files of a bag in their order; what is listed and not there is told."""
    listed = told.get("relative_file_paths")
    if not isinstance(listed, list) or not listed:
        return _files_in(folder)
    files = [folder / PurePosixPath(str(name)).name for name in listed]
    faults += [f"{file.name} is listed and not there" for file in files if not file.is_file()]
    return [file for file in files if file.is_file()] or _files_in(folder)


def _files_in(folder: Path) -> list[Path]:
    try:
        found = [one for one in folder.iterdir() if one.name.removesuffix(".zstd").endswith(_SUFFIXES)]
    except OSError:
        return []
    return sorted((one for one in found if one.is_file()), key=lambda one: natural(one.name))


def _counts(told: dict[str, Any]) -> dict[str, int]:
    """Return the messages by topic, as the metadata tell, where they do."""
    counts: dict[str, int] = {}
    topics = told.get("topics_with_message_count")
    for one in topics if isinstance(topics, list) else []:
        try:
            name, count = str(one["topic_metadata"]["name"]), int(one["message_count"])
        except (KeyError, TypeError, ValueError):
            continue
        counts[name] = counts.get(name, 0) + count
    return counts
