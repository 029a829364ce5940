"""Writing the experiment folder of a session, with where it comes from, or its streams as tables."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from daq.errors import RecordingError, SynchronisationError
from daq.export.ro_crate.crate import EXPERIMENT, RoCrate, write_ro_crate
from daq.export.ro_crate.publication import Publication
from daq.export.ros2_bag import Ros2Bag, write_ros2_bag
from daq.export.stream_tables import Table, stream_tables, synchronised_table
from daq.export.table_formats import FORMATS
from daq.files.atomic import appearing
from daq.files.toml_tables import toml_text
from daq.progress import Progress
from daq.recording.folder import CHECKSUMS_FILE, sha256, verify_checksums
from daq.recording.reader import Recording, open_recording
from daq.synchronisation.experiment_rows import Synchronised, synchronise
from daq.versions import package_versions
from daq.vision.errors import VisionError
from estimator.experiment import Experiment, read_experiment, write_experiment

if TYPE_CHECKING:
    from daq.export.lerobot.dataset import LerobotDataset

_METHOD = (
    "every row is the mean over a measuring window; the noise of a row is the scatter of four sub-means of its window "
    "(of the single images for the fiducials), pooled over all rows, with the rig file's uncertainty in quadrature"
)


@dataclass(frozen=True, slots=True)
class StreamProvenance:
    """What a stream contributed, and how well its clock was mapped to the host's.

    Attributes
    ----------
    rows : samples in each row
    period_s : between samples
    gaps, resets : in the whole recording
    delay_s : 50 %, 95 %, 99.9 % and largest delay of the receive stamps over the mapped clock
    wander_ppm : of its clock
    """

    name: str
    rows: tuple[int, ...]
    period_s: float
    gaps: int
    resets: int
    delay_s: tuple[float, float, float, float]
    wander_ppm: float


@dataclass(frozen=True, slots=True)
class Rejection:
    """What the cameras saw and vision did not use: stage and reason, and how often in all images."""

    reason: str
    count: int


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where an experiment comes from; ``checksums_sha256`` is of the session's list of checksums."""

    session: str
    started: str
    state: str
    problems: tuple[str, ...]
    checksums_sha256: str
    software: str
    method: str
    streams: tuple[StreamProvenance, ...]
    rejected: tuple[Rejection, ...]


@dataclass(frozen=True, slots=True)
class _Annex:
    provenance: Provenance


def export_experiment(session: Path, target: Path, progress: Progress) -> tuple[Experiment, Provenance]:
    """Synchronise a sealed session and write its experiment folder, all of it or nothing.

    Raises
    ------
    RecordingError, RigError, SynchronisationError
        The session cannot be used.
    InputError
        The target exists, or the outcome cannot be right.
    """
    recording = sealed_recording(session)
    with appearing(target) as draft:
        provenance = _write_synchronised(recording, draft, progress)
    return read_experiment(target), provenance


def _write_synchronised(recording: Recording, folder: Path, progress: Progress) -> Provenance:
    """Write the experiment of a recording into a new folder, with where it comes from."""
    synchronised = synchronise(recording, progress)
    write_experiment(synchronised.experiment, folder)
    provenance = _provenance(recording, synchronised)
    with (folder / "experiment.toml").open("a", encoding="utf-8") as file:
        file.write(toml_text(_Annex(provenance), folder))
    return provenance


@dataclass(frozen=True, slots=True)
class ExportedTables:
    """Rows of each table that was written, and why there is no synchronised one; empty where there is."""

    rows: dict[str, int]
    unsynchronised: str


def export_tables(session: Path, file_format: str, target: Path, progress: Progress) -> ExportedTables:
    """Write the streams of a sealed session, and the synchronised table, in one of :data:`FORMATS`.

    A session without a measuring window at rest, or without beads, has streams all the same; what it lacks is told.

    Parameters
    ----------
    target : a new file for HDF5 and NPZ, a new folder for CSV and Parquet; it appears whole or not at all

    Raises
    ------
    RecordingError, RigError
        The session cannot be used.
    InputError
        The target exists.
    """
    recording = sealed_recording(session)
    with appearing(target) as draft:
        progress("reading the streams", 0, 2)
        tables: list[Table] = list(stream_tables(recording))
        unsynchronised = ""
        try:
            tables.append(synchronised_table(synchronise(recording, progress).experiment))
        except (SynchronisationError, VisionError) as error:
            unsynchronised = str(error)
        progress("writing the tables", 1, 2)
        FORMATS[file_format](tables, draft)
    return ExportedTables({table.name: len(table) for table in tables}, unsynchronised)


def export_ros2(session: Path, target: Path, progress: Progress) -> Ros2Bag:
    """Write the streams of a sealed session as a rosbag2 folder of standard messages, stamped with the wall clock.

    Raises
    ------
    RecordingError
        The session cannot be used.
    InputError
        The target exists.
    """
    recording = sealed_recording(session)
    with appearing(target) as draft:
        return write_ros2_bag(recording, draft, progress)


def export_lerobot(
    sessions: Sequence[Path], target: Path, fps: int | None, progress: Progress, *, as_video: bool = False
) -> "LerobotDataset":
    """Write sealed sessions as the episodes of a LeRobot dataset.

    Parameters
    ----------
    fps : frames a second; None for the rate of the slowest camera
    as_video : whether images become video, which is small and not without loss

    Raises
    ------
    RecordingError, RigError, SynchronisationError
        A session cannot be used, or differs from the others.
    InputError
        The target exists.
    """
    from daq.export.lerobot.dataset import write_lerobot  # 36 MB of pyarrow, for this format alone

    recordings = [sealed_recording(session) for session in sessions]
    with appearing(target) as draft:
        return write_lerobot(recordings, draft, fps, progress, as_video=as_video)


def export_ro_crate(session: Path, target: Path, publication: Publication, progress: Progress) -> RoCrate:
    """Write a sealed session, and its experiment where there can be one, as an RO-Crate.

    Raises
    ------
    RecordingError, RigError
        The session cannot be used.
    InputError
        The target exists.
    """
    recording = sealed_recording(session)
    with appearing(target) as draft:
        draft.mkdir()
        unsynchronised = ""
        try:
            _write_synchronised(recording, draft / EXPERIMENT, progress)
        except (SynchronisationError, VisionError) as error:
            unsynchronised = str(error)
        return write_ro_crate(recording, draft, unsynchronised, publication, progress)


def sealed_recording(session: Path) -> Recording:
    """Open a session that is as it was sealed; one that was cut off is recovered first."""
    recording = open_recording(session)
    if altered := verify_checksums(session):
        raise RecordingError(
            f"{session}: {', '.join(altered)} differ from what was sealed; restore them from a copy, or run "
            f"`retract recover {session}`, which checks the recordings and tells what is lost"
        )
    return recording


def _provenance(recording: Recording, synchronised: Synchronised) -> Provenance:
    info = recording.info
    return Provenance(
        session=recording.folder.name,
        started=info.clock_anchor.iso,
        state=info.state,
        problems=info.problems,
        checksums_sha256=sha256(recording.folder / CHECKSUMS_FILE),
        software=", ".join(f"{name} {version}" for name, version in package_versions().items()),
        method=_METHOD,
        streams=tuple(
            StreamProvenance(
                name,
                synchronised.samples[name],
                times.period_s,
                len(times.gap_ends),
                times.resets,
                times.residual_s,
                times.wander_ppm,
            )
            for name, times in synchronised.times.items()
        ),
        rejected=tuple(Rejection(reason, count) for reason, count in sorted(synchronised.rejected.items())),
    )
