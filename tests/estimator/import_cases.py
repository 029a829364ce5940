"""An import as a user does it: a proposed mapping, its open lines filled in, the experiment."""

import json
from collections.abc import Callable
from pathlib import Path

from import_files import (
    GRASP,
    ORIGIN_MM,
    SIZE,
    Measurement,
    field,
    measurement,
    write_c3d,
    write_csv,
    write_german_csv,
    write_hdf5,
    write_mat5,
    write_mat73,
    write_npz,
    write_xlsx,
)

from estimator.experiment import Experiment, read_experiment
from estimator.importing import import_experiment

MEASURED = measurement()
FLAT, SOLID = field(2), field(3)
FORMATS: dict[str, Callable[[Measurement, Path], None]] = {
    "trial.csv": write_csv,
    "german.csv": write_german_csv,
    "trial.xlsx": write_xlsx,
    "trial.npz": write_npz,
    "trial.h5": write_hdf5,
    "trial.mat": write_mat5,
    "trial73.mat": write_mat73,
    "trial.c3d": write_c3d,
}
SIZE_TEXT = json.dumps(list(SIZE))
BODY = {
    "[phantom] shape": '"block"',
    "[phantom] size": SIZE_TEXT,
    "[grasp] box": json.dumps([list(GRASP.box.lower), list(GRASP.box.upper)]),
    "[[anchor]] box": '"x-"',
    "[environment] surface_below": '"table"',
    "[sensor] force_std": "0.01",
    "[sensor] fiducial_std": "5e-5",
    "[frame] origin": json.dumps([1e-3 * value for value in ORIGIN_MM]),
    "[beads] unit": '"mm"',
    "[force] is_of": '"gripper on tissue"',
}

# A body of one's own, whatever was measured of it.
SMALL_BODY = {
    "[phantom] shape": '"block"',
    "[phantom] size": "[0.06, 0.03, 0.01]",
    "[grasp] box": '"x+ 0.012"',
    "[[anchor]] box": '"x-"',
    "[environment] surface_below": '"none"',
    "[sensor] force_std": "0.01",
    "[sensor] torque_std": "0.001",
    "[sensor] fiducial_std": "5e-5",
}


def completed(file: Path, answers: dict[str, str], **instead: str) -> list[str]:
    """Fill in the lines that are open by their keys, replace others by how they begin; return what was open."""
    heading, lines, asked = "", [], []
    for line in file.read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            heading = line.split("#")[0].strip()
        key = f"{heading} {line.partition('=')[0].strip()}"
        if '"?"' in line.split("#")[0]:
            asked.append(key)
            value = answers[key]
            line = line.replace('"?"', value, 1)  # noqa: PLW2901 - the line as it is written
        for begin, replacement in instead.items():
            if line.startswith(f"{begin} ="):
                line = f"{begin} = {replacement}"  # noqa: PLW2901
        lines.append(line)
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return asked


def imported(
    source: Path, folder: Path, answers: dict[str, str], **instead: str
) -> tuple[Experiment, list[str]]:
    """Import in the two steps of a user; return the experiment and what was asked."""
    first = import_experiment(source, folder)
    assert first.proposed
    assert first.open_lines
    asked = completed(first.mapping, answers, **instead)
    assert asked == [key for _, key in first.open_lines]
    second = import_experiment(source, folder)
    assert second.open_lines == ()
    assert second.refusal == ""
    assert second.picture is not None
    assert second.picture.stat().st_size > 0
    return read_experiment(folder), asked
