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
    stereo = None if rig.stereo_calibration is None else calibrations / rig.stereo_calibration.name
    try:
        folder.mkdir(parents=True)
        calibrations.mkdir()
        copies = set(in_force.copy_to(calibrations))
        if stereo is not None and rig.stereo_calibration is not None:
            shutil.copyfile(rig.stereo_calibration, stereo)
            copies.add(stereo)
    except OSError as error:
        raise RecordingError(f"{folder}: no session can be put there ({error}); name a new folder") from error
    # who may look on is nobody's business afterwards, and their token a secret
    kept = replace(
        rig, stereo_calibration=stereo, calibration=calibrations, laboratory_clock=None, viewers=None
    )
    write_rig(kept, folder / RIG_FILE)
    return {
        path.relative_to(folder).as_posix(): sha256(path) for path in (folder / RIG_FILE, *sorted(copies))
    }
