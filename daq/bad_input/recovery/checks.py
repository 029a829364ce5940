"""A damaged session is recovered, and what comes of it is compared with what was recorded.

What has to hold: every sample of a chunk that the damage has not touched is there; every sample that is there is the
recorded one; a recorded file is as it was until its successor has been read back; the told loss is the true one.
"""

import itertools
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from unittest.mock import patch

from daq.bad_input.damage.recording import RECORDING
from daq.bad_input.recovery.originals import Original, Streams, streams_of
from daq.errors import DaqError, RecordingError
from daq.export import sealed_recording
from daq.recording.folder import CHECKSUMS_FILE, INFO_FILE, RECORDED_FILES, RIG_FILE, read_info
from daq.recording.layout import CAMERAS_FILE, SIGNALS_FILE
from daq.recording.reader import Recording
from daq.recording.recovery import Recovery, recover_session
from estimator.errors import EstimatorError

_INTERRUPTED_SHARE = 0.3
_FILES = (*(SIGNALS_FILE,) * 9, *(CAMERAS_FILE,) * 7, INFO_FILE, CHECKSUMS_FILE, RIG_FILE)


@dataclass(frozen=True, slots=True)
class Verdict:
    """What came of one damaged session.

    Attributes
    ----------
    damage : the file and what was done to it
    outcome : ``unchanged``, ``refused`` or ``recovered``
    lost, told : samples in all that are missing, and that were told to be
    estimated : whether a part of what was told is estimated
    complaint : what is wrong with the behaviour; empty where nothing is
    """

    damage: str
    outcome: str
    lost: int = 0
    told: int = 0
    estimated: bool = False
    complaint: str = ""


def judge(original: Original, random: Random, folder: Path) -> Verdict:
    """Damage a copy of a session in a new folder, recover it and judge."""
    name = random.choice([name for name in _FILES if name in original.files])
    damage = random.choice(RECORDING)
    content = damage(random, original.files[name])
    return judge_damage(original, name, content, damage.__name__, random, folder)


def judge_damage(
    original: Original, name: str, content: bytes, told_as: str, random: Random, folder: Path
) -> Verdict:
    """Judge what comes of a session in which one file has another content."""
    label = f"{'sealed' if original.sealed else 'cut'} {name}: {told_as}"
    given = {**original.files, name: content}
    for file, data in given.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_bytes(data)
    if content == original.files[name]:
        return Verdict(label, "unchanged")
    complaint = _used_before(original, folder)
    again = random.random() < _INTERRUPTED_SHARE
    if not complaint and again:
        complaint = _interrupted(given, original, random, folder)
    try:
        recovery = recover_session(folder)
    except (DaqError, EstimatorError) as error:
        if again and read_state(folder) == "recovered":  # the interrupted attempt had done all
            return _compared(label, original, given, None, folder, complaint)
        return Verdict(
            label, "refused", complaint=complaint or _refused(original, name, given, str(error), folder)
        )
    except Exception as error:  # noqa: BLE001 - whatever escapes is what this program looks for
        return Verdict(label, "refused", complaint=f"{type(error).__name__}: {error}")
    return _compared(label, original, given, None if again else recovery, folder, complaint)


def read_state(folder: Path) -> str:
    """Return what the description of a session says of it, nothing where it cannot be read."""
    try:
        return read_info(folder).state
    except RecordingError:
        return ""


def _used_before(original: Original, folder: Path) -> str:
    """Return what is wrong with how a damaged session is read before it is recovered."""
    openers: Sequence[Callable[[Path], Recording]] = (
        (Recording, sealed_recording) if original.sealed else (Recording,)
    )
    for opener in openers:
        try:
            found = streams_of(opener(folder))
        except (DaqError, EstimatorError) as error:
            # what cannot be opened cannot be exported
            return f"refused in several lines: {str(error)[:200]!r}" if "\n" in str(error) else ""
        except Exception as error:  # noqa: BLE001 - whatever escapes is what this program looks for
            return f"before recovery {type(error).__name__}: {error}"
        if wrong := _wrong(original, found):
            return f"read without recovery: {wrong}"
        listed = (folder / CHECKSUMS_FILE).read_bytes() if original.sealed else b""
        # a list without a line of a file that is none of a session's says nothing wrong
        if opener is sealed_recording and listed not in original.files[CHECKSUMS_FILE]:
            return "exported although it is not what was sealed"
    return ""


def _wrong(original: Original, found: Streams) -> str:
    """Return a sample that is not as it was recorded."""
    for stream, samples in found.items():
        for number, sample in samples.items():
            if original.streams.get(stream, {}).get(number) != sample:
                return f"{stream} {number} is not what was recorded"
    return ""


class _Interrupt(BaseException):
    """The death of the process, as far as it can be had within it."""


@contextmanager
def _dying_at(sync: int) -> Iterator[None]:
    """Die when so many files have been brought to the disk."""
    real, count = os.fsync, itertools.count()

    def dying(descriptor: int) -> None:
        if next(count) >= sync:
            raise _Interrupt
        real(descriptor)

    with patch.object(os, "fsync", dying):
        yield


def _interrupted(given: Mapping[str, bytes], original: Original, random: Random, folder: Path) -> str:
    """Recover, die on the way, and return which usable chunk was written over; what is left is recovered next."""
    try:
        with _dying_at(random.randrange(5)):
            recover_session(folder)
        for file, data in given.items():
            (folder / file).write_bytes(data)
        (folder / CHECKSUMS_FILE).unlink(missing_ok=CHECKSUMS_FILE not in given)
        if CHECKSUMS_FILE in given:
            (folder / CHECKSUMS_FILE).write_bytes(given[CHECKSUMS_FILE])
    except _Interrupt:
        for file in RECORDED_FILES:
            left = (folder / file).read_bytes()
            if any(data in given[file] and data not in left for data, _ in original.intact[file]):
                return f"{file}: a usable chunk was gone when recovery was interrupted"
    except (DaqError, EstimatorError):
        pass
    return ""


def _refused(original: Original, name: str, given: Mapping[str, bytes], told: str, folder: Path) -> str:
    """Return what is wrong with a refusal: of a file with something usable in it, or with traces of it left."""
    for file, data in given.items():
        if (folder / file).read_bytes() != data:
            return f"refused, and changed {file}"
    if "\n" in told:
        return f"refused in several lines: {told[:200]!r}"
    if name in RECORDED_FILES and any(data in given[name] for data, _ in original.intact[name]):
        return f"refused although {name} holds whole chunks: {told[:200]}"
    # a description of another version, or with another checksum of the rig: nobody can tell which of both is damaged
    undecidable = name == INFO_FILE and ("is not of the format" in told or f"{RIG_FILE} differ" in told)
    if name in (CHECKSUMS_FILE, INFO_FILE) and "nothing to recover" not in told and not undecidable:
        return f"refused because of {name}: {told[:200]}"
    return ""


def _compared(
    label: str,
    original: Original,
    given: Mapping[str, bytes],
    recovery: Recovery | None,
    folder: Path,
    complaint: str,
) -> Verdict:
    try:
        recording = sealed_recording(folder)
        found = streams_of(recording)
    except (DaqError, EstimatorError) as error:
        return Verdict(label, "recovered", complaint=complaint or f"cannot be read after recovery: {error}")
    missing = {
        stream: sorted(set(samples) - set(found.get(stream, {})))
        for stream, samples in original.streams.items()
    }
    lost = sum(map(len, missing.values()))
    complaint = complaint or _wrong(original, found) or _lost_chunk(original, given, found)
    if (
        recovery is None
    ):  # a second attempt, behind one that was interrupted: what the first found is in the problems
        problems = " ".join(recording.info.problems)
        untold = [s for s, numbers in missing.items() if numbers and s not in problems]
        if not complaint and untold and original.sealed:
            complaint = f"after an interruption, the loss of {untold[0]} is not told: {problems[:300]}"
        return Verdict(label, "recovered", lost, lost, estimated=False, complaint=complaint)
    told = sum(loss.samples for loss in recovery.lost.values())
    estimated = any(loss.estimated for loss in recovery.lost.values())
    complaint = complaint or _wrongly_told(original, missing, found, recovery)
    if not complaint and recovery.left_out_bytes > sum(len(given[name]) for name in RECORDED_FILES):
        complaint = f"told {recovery.left_out_bytes} bytes, more than there were"
    return Verdict(label, "recovered", lost, told, estimated, complaint)


def _lost_chunk(original: Original, given: Mapping[str, bytes], found: Streams) -> str:
    for file, parts in original.intact.items():
        for data, samples in parts:
            gone = [s for s, numbers in samples.items() if not set(numbers) <= set(found.get(s, {}))]
            if gone and data in given[file]:
                return f"{file}: an undamaged chunk with samples of {gone[0]} is lost"
    return ""


def _wrongly_told(
    original: Original, missing: Mapping[str, list[int]], found: Streams, recovery: Recovery
) -> str:
    """Compare the told loss with the true one: exact, or said to be estimated and no less than what is certain."""
    for stream, numbers in missing.items():
        told = recovery.lost.get(stream)
        last = max(found.get(stream, {}), default=-1)
        certain = sum(number < last for number in numbers)
        exact = told is None or not told.estimated
        count = 0 if told is None else told.samples
        if exact and count != len(numbers):
            seen = bool(found.get(stream)) and _damaged(recovery, stream)
            without_trace = not original.sealed and count == certain and not seen
            if not without_trace:
                return f"{stream}: told {count} lost, and {len(numbers)} are"
        if not exact and count < certain:
            return f"{stream}: told about {count} lost, and at least {certain} are"
        if original.sealed and not exact and INFO_FILE not in str(recovery.info.problems):
            return f"{stream}: estimated although the session tells"
    return ""


def _damaged(recovery: Recovery, stream: str) -> bool:
    """Tell whether anything was found that cannot be used in the file of a stream."""
    file = CAMERAS_FILE if stream.startswith("camera") else SIGNALS_FILE
    return bool(recovery.files[file].damages)
