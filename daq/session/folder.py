"""The folder of a session before anything is recorded: the rig file, and copies of what is in force."""

import shutil
from dataclasses import replace
from pathlib import Path

from daq.calibration_files.in_force import InForce
from daq.errors import RecordingError
from daq.recording.folder import CALIBRATION_FOLDER, RIG_FILE, sha256
from daq.rig import Rig, write_rig


def make_folder(folder: Path, rig: Rig, in_force: InForce) -> dict[str, str]:
    """Make a new folder and return the checksums of the files in it, by their paths within.

    Raises
    ------
    RecordingError
        No session can be put there.
    """
    calibrations = folder / CALIBRATION_FOLDER
    files = [rig.stereo_calibration, None if rig.only_view is None else rig.only_view.calibration]
    stereo, only = (None if file is None else calibrations / file.name for file in files)
    try:
        folder.mkdir(parents=True)
        calibrations.mkdir()
        copies = set(in_force.copy_to(calibrations))
        for file, copy in zip(files, (stereo, only), strict=True):
            if file is not None and copy is not None:
                shutil.copyfile(file, copy)
                copies.add(copy)
    except OSError as error:
        raise RecordingError(f"{folder}: no session can be put there ({error}); name a new folder") from error
    # who may look on is nobody's business afterwards, and their token a secret
    kept = replace(
        rig if only is None else rig.with_only_view_of(only),
        stereo_calibration=stereo,
        calibration=calibrations,
        laboratory_clock=None,
        viewers=None,
    )
    write_rig(kept, folder / RIG_FILE)
    return {
        path.relative_to(folder).as_posix(): sha256(path) for path in (folder / RIG_FILE, *sorted(copies))
    }
