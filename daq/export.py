"""Writing the experiment folder of a session, with where it comes from."""

from dataclasses import dataclass
from pathlib import Path

from daq.errors import RecordingError
from daq.progress import Progress
from daq.recording.folder import CHECKSUMS_FILE, sha256, verify_checksums
from daq.recording.reader import Recording
from daq.sync import Synchronised, synchronise
from daq.toml_tables import toml_text
from daq.versions import package_versions
from estimator.experiment import Experiment, write_experiment

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


@dataclass(frozen=True, slots=True)
class _Annex:
    provenance: Provenance


def export_experiment(session: Path, target: Path, progress: Progress) -> tuple[Experiment, Provenance]:
    """Synchronise a sealed session and write its experiment folder.

    Raises
    ------
    RecordingError, RigError, SynchronisationError
        The session cannot be used.
    InputError
        The target exists, or the outcome cannot be right.
    """
    recording = Recording(session)
    if recording.info.state == "recording":
        raise RecordingError(
            f"{session}: is not sealed; if nothing records into it any more, run `retract recover` on it"
        )
    if altered := verify_checksums(session):
        raise RecordingError(
            f"{session}: {', '.join(altered)} differ from what was sealed; restore them from a copy"
        )
    synchronised = synchronise(recording, progress)
    experiment = write_experiment(synchronised.experiment, target)
    provenance = _provenance(recording, synchronised)
    with (target / "experiment.toml").open("a", encoding="utf-8") as file:
        file.write(toml_text(_Annex(provenance), target))
    return experiment, provenance


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
    )
