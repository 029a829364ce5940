"""From a file or a folder to a checked experiment folder, by a mapping that is proposed where there is none."""

import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from estimator.errors import InputError
from estimator.experiment.model import Experiment
from estimator.experiment.writing import write_experiment
from estimator.experiment_checks.checking import findings_of
from estimator.experiment_checks.finding import Finding
from estimator.importing.applying import experiment_of
from estimator.importing.formats.opening import read_source
from estimator.importing.mapping import open_lines, read_mapping
from estimator.importing.pictures.picture import draw_experiment
from estimator.importing.pictures.proposal_picture import draw_proposal
from estimator.importing.proposal_text import text_of
from estimator.importing.proposing import propose
from estimator.importing.table import Source

MAPPING_SUFFIX = ".import.toml"
PICTURE_SUFFIX = ".import.png"


@dataclass(frozen=True, slots=True, eq=False)
class Imported:
    """What came of an import.

    Attributes
    ----------
    mapping : file that says what the columns are, beside the experiment
    open_lines : of it, with their keys; if there are any, nothing else was done
    proposed : whether the mapping was written now
    experiment : None where lines are open, or it was not written
    picture : of it, or of what was understood for the proposal
    findings : of the checks, the worst first
    refusal : why no experiment was written
    remarks : what of the source was left out or is damaged, a line each
    """

    mapping: Path
    open_lines: tuple[tuple[int, str], ...] = ()
    proposed: bool = False
    experiment: Experiment | None = None
    picture: Path | None = None
    findings: tuple[Finding, ...] = ()
    refusal: str = ""
    remarks: tuple[str, ...] = ()


def import_experiment(
    source: Path | str | Source, output: Path | str, mapping: Path | str | None = None
) -> Imported:
    """Import a file, a folder, or what was read of one as a new experiment folder.

    Parameters
    ----------
    source : CSV, XLSX, NPZ, HDF5, MAT, C3D, a folder of files or of frames; or tables that were read elsewhere
    output : experiment folder to write; ``OUTPUT.import.toml`` and ``OUTPUT.import.png`` are written beside it
    mapping : None for ``OUTPUT.import.toml``, which is proposed if it is not there

    Raises
    ------
    InputError
        The source or the mapping cannot be read, they contradict each other, or the output is there already.
    """
    target = Path(output)
    if target.exists():
        raise InputError(f"{target}: exists already; give another name, or remove it first")
    beside = target.with_name(target.name + MAPPING_SUFFIX)
    picture = target.with_name(target.name + PICTURE_SUFFIX)
    read = source if isinstance(source, Source) else read_source(source)
    proposed = mapping is None and not beside.exists()
    if proposed:
        beside.parent.mkdir(parents=True, exist_ok=True)
        proposal = propose(read)
        beside.write_text(text_of(proposal, target), encoding="utf-8")
        draw_proposal(proposal, picture)
    file = beside if mapping is None else Path(mapping)
    missing = open_lines(file)
    if missing:
        return Imported(
            file, tuple(missing), proposed, picture=picture if proposed else None, remarks=read.remarks
        )
    with tempfile.TemporaryDirectory() as scratch:
        experiment = experiment_of(read, read_mapping(file), Path(scratch))
        findings = findings_of(replace(experiment, path=target))
        beside.parent.mkdir(parents=True, exist_ok=True)
        draw_experiment(experiment, picture)
        try:
            written = write_experiment(experiment, target)
        except InputError as error:
            return Imported(file, (), proposed, None, picture, tuple(findings), str(error), read.remarks)
    if file.resolve() != beside.resolve():
        shutil.copyfile(file, beside)
    return Imported(file, (), proposed, written, picture, tuple(findings), remarks=read.remarks)


def told(lines: Sequence[tuple[int, str]]) -> str:
    """Return open lines for a message."""
    return "; ".join(f"line {number} ({key})" for number, key in lines)
