"""All kinds of files that a user hands over, with the readers and the verbs that read them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from daq.bad_input import samples, session_sample, surface_samples
from daq.bad_input.damage import BINARY, TEXT, Damage
from daq.bad_input.import_kinds import IMPORT_KINDS
from daq.bad_input.kind import Kind
from daq.bad_input.layout_damage import MCAP, NUMBERS, PLY, STL, VTP
from daq.bad_input.machine_exports import TEXT_LAYOUTS, YOUNGS_MODULUS
from daq.bad_input.places import PLACES, enormous
from daq.bad_input.recording_damage import RECORDING
from daq.bad_input.rewriting import REWRITTEN
from daq.bad_input.sheet_damage import SHEETS
from daq.bad_input.value_damage import JSON, JSON_LINES, TABLE, TOML
from daq.calibration.in_force import calibrations_in_force
from daq.calibration.stored_views import find_views
from daq.export import sealed_recording
from daq.faults.campaign import read_results
from daq.own_trajectories import read_table
from daq.plans import due_runs, journal_path, read_plan
from daq.recording.folder import RIG_FILE
from daq.recording.reader import open_recording
from daq.recording.recovery.session import recover_session
from daq.rig import make_devices, read_rig
from daq.session_report import read_report
from daq.vision.camera_model import StereoCalibration
from estimator import result_lines, uniaxial
from estimator.blind.scoring.keys import OPENINGS_FILE
from estimator.blind.scoring.running import case_names
from estimator.blind.scoring.score import score_answers
from estimator.blind.scoring.telling import score_text
from estimator.experiment import read_case, read_experiment
from estimator.fit import coverage
from estimator.materials import law_named
from estimator.studies.store import OutcomeStore
from estimator.surfaces.reading import read_surface
from robot_drivers.cameras.opencv import OpenCVCamera
from robot_drivers.cameras.opencv_capture import OpenCVCameraSettings

_SESSION = "session"
_RIGHT = 0.02  # of the modulus
_IN_TEXT = (*TEXT, *NUMBERS)
# A recording has no largest size: recovery looks through twenty gigabytes, which takes a minute and is no finding.
_PLACES_OF_RECORDINGS = tuple(place for place in PLACES if place is not enormous)


def _read_plan(folder: Path) -> object:
    plan = folder / "plan.toml"
    return due_runs(read_plan(plan), journal_path(plan), folder)


def _read_session(folder: Path) -> object:
    recording = open_recording(folder / _SESSION)
    read_rig(folder / _SESSION / RIG_FILE)
    images = [recording.images(name) for name in recording.cameras]
    decoded = [one.image(number) for one in images for number in range(len(one))]
    return recording.force, recording.robot, recording.events, decoded


def _read_benchmark(folder: Path) -> object:
    return score_text(score_answers([(folder / "answers", folder / "keys")]))


def _fit_uniaxial(folder: Path, name: str = "record.csv") -> uniaxial.UniaxialFit:
    fit = uniaxial.fit_record(uniaxial.read_record(folder / name), [law_named("neo_hookean")])
    uniaxial.as_text(fit)
    return fit


def _fit_gel(folder: Path) -> object:
    """Fit a rewritten export, which is refused or gives the right modulus."""
    modulus = _fit_uniaxial(folder).best.fit.youngs_modulus.value
    if abs(modulus / YOUNGS_MODULUS - 1) > _RIGHT:
        raise AssertionError(f"E = {modulus:.0f} Pa, and {YOUNGS_MODULUS:.0f} Pa is right")
    return modulus


def _uniaxial(name: str) -> Callable[[Path, Path], list[str]]:
    return lambda given, out: [
        "uniaxial", str(given / name), "--law", "neo_hookean", "--output", str(out / "report")
    ]  # fmt: skip


def _export_of_machine(layout: str) -> Kind:
    return Kind(
        f"export, {layout}",
        lambda folder: samples.machine_export(folder, layout),
        {"record.csv": (*TEXT, *TABLE, *NUMBERS)},
        read=_fit_uniaxial,
        command=_uniaxial("record.csv"),
        quick=True,
    )


def _apply_calibration(folder: Path) -> object:
    rig = replace(read_rig(folder / "rig.toml"), calibration=folder)
    return calibrations_in_force(rig, {}).apply(rig)


def _export(given: Path, out: Path) -> list[str]:
    return ["export", str(given / _SESSION), "--format", "csv", "--output", str(out / "tables")]


def _record_plan(given: Path, out: Path) -> list[str]:
    return ["record", str(given / "rig.toml"), "--plan", str(given / "plan.toml")]


def _estimate(given: Path, out: Path) -> list[str]:
    return ["estimate", str(given / "pull"), "--report", str(out / "page.html")]


def _score(given: Path, out: Path) -> list[str]:
    return [
        "benchmark", "score", str(given / "answers"), str(given / "keys"), "--output", str(out / "score.html")
    ]  # fmt: skip


def _surface(name: str, file: str, write: Callable[[Path], None], damages: Sequence[Damage]) -> Kind:
    """Return the kind of a surface file, which is read by ``retract mesh``."""
    return Kind(
        name,
        write,
        {file: damages},
        read=lambda folder: read_surface(folder / file),
        command=lambda given, out: ["mesh", str(given / file), "-o", str(out / "mesh.vtu")],
    )


def _play_images(folder: Path) -> object:
    camera = OpenCVCamera(OpenCVCameraSettings(source=str(folder / "image%02d.png"), fps=25.0))
    camera.connect()
    try:
        return camera.read(timeout_s=1.0)
    finally:
        camera.close()


def _faults(given: Path, out: Path) -> list[str]:
    return ["faults", "--seed", "1", "--runs", "1", "--out", str(given / "results.jsonl")]


def _session(name: str, write: Callable[[Path], None], file: str, damages: Sequence[Damage]) -> Kind:
    """Return the kind of a session folder in which one file is damaged."""
    return Kind(
        name,
        write,
        {f"{_SESSION}/{file}": damages},
        read=_read_session,
        command=_export,
        quick=True,
    )


KINDS: tuple[Kind, ...] = (
    Kind(
        "rig",
        samples.rig,
        {"rig.toml": (*TEXT, *TOML)},
        read=lambda folder: make_devices(read_rig(folder / "rig.toml")),
        command=lambda given, out: ["devices", str(given / "rig.toml")],
    ),
    Kind(
        "stereo calibration",
        samples.rig,
        {"stereo.toml": (*TEXT, *TOML)},
        read=lambda folder: StereoCalibration.load(folder / "stereo.toml"),
    ),
    Kind(
        "kept calibration",
        samples.calibration,
        {"force_*.toml": (*TEXT, *TOML), "time_*.toml": TOML},
        read=_apply_calibration,
    ),
    Kind(
        "views of the board",
        samples.views,
        {"left*.png": BINARY},
        read=lambda folder: list(find_views(folder).read()),
        command=lambda given, out: [
            "calibrate", "cameras", str(given / "rig.toml"), "--images", str(given), "--output", str(out / "kept")
        ],
        quick=True,
    ),
    Kind(
        "plan",
        samples.plan,
        {"plan.toml": (*TEXT, *TOML)},
        read=_read_plan,
        command=_record_plan,
    ),
    Kind(
        "journal of a plan",
        samples.plan,
        {"plan.journal.json": (*TEXT, *JSON)},
        read=_read_plan,
        command=_record_plan,
    ),
    Kind(
        "trajectory table",
        samples.trajectory_table,
        {"table.csv": (*TEXT, *TABLE)},
        read=lambda folder: read_table(folder / "table.csv"),
        command=lambda given, out: [
            "record", str(given / "rig.toml"), "--trajectory", str(given / "table.csv"), "--output", str(out / "s")
        ],
    ),
    Kind(
        "experiment",
        samples.experiment,
        {"pull/experiment.toml": (*TEXT, *TOML)},
        read=lambda folder: read_experiment(folder / "pull"),
        command=_estimate,
    ),
    Kind(
        "observations",
        samples.experiment,
        {"pull/observations.csv": (*TEXT, *TABLE)},
        read=lambda folder: read_experiment(folder / "pull"),
        command=_estimate,
    ),
    Kind(
        "experiment's surface",
        samples.experiment_of_surface,
        {"pull/phantom.stl": (*BINARY, *STL)},
        read=lambda folder: read_experiment(folder / "pull"),
        command=lambda given, out: ["mesh", str(given / "pull"), "-o", str(out / "mesh.vtu")],
    ),
    Kind(
        "experiment's PLY",
        surface_samples.experiment_of_ply,
        {"pull/body.ply": (*BINARY, *PLY), "pull/experiment.toml": (*TEXT, *TOML)},
        read=lambda folder: read_experiment(folder / "pull"),
        command=lambda given, out: ["mesh", str(given / "pull"), "-o", str(out / "mesh.vtu")],
    ),
    Kind(
        "case",
        samples.case,
        {"case/again/experiment.toml": TOML, "case/pull/observations.csv": TABLE},
        read=lambda folder: read_case(folder / "case"),
        command=lambda given, out: ["diagnose", str(given / "case"), "--output", str(out / "report")],
    ),
    _session("session description", session_sample.sealed_session, "session.json", (*TEXT, *JSON)),
    Kind(
        "session's checksums",
        session_sample.sealed_session,
        {"session/CHECKSUMS.sha256": TEXT},
        read=lambda folder: sealed_recording(folder / _SESSION),
        command=_export,
    ),
    _session("session's rig", session_sample.sealed_session, "rig.toml", (*TEXT, *TOML)),
    Kind(
        "session's report",
        session_sample.reported_session,
        {"session/derived/report.json": (*TEXT, *JSON)},
        read=lambda folder: read_report(folder / _SESSION).lines(),
    ),
    _session("signals", session_sample.sealed_session, "signals.mcap", (*BINARY, *MCAP, *RECORDING)),
    _session("images", session_sample.sealed_session, "cameras.mcap", (*BINARY, *MCAP, *RECORDING)),
    *(
        _session(f"signals, {form}", partial(session_sample.rewritten_session, form=form), "signals.mcap", RECORDING)
        for form in session_sample.FORMS
    ),
    Kind(
        "sealed session to recover",
        session_sample.damaged_session,
        {
            "session/signals.mcap": (*BINARY, *MCAP, *RECORDING),
            "session/cameras.mcap": RECORDING,
            "session/session.json": (*TEXT, *JSON),
            "session/CHECKSUMS.sha256": TEXT,
        },
        read=lambda folder: recover_session(folder / _SESSION),
        command=lambda given, out: ["recover", str(given / _SESSION)],
        places=_PLACES_OF_RECORDINGS,
    ),
    Kind(
        "session for ROS 2",
        session_sample.sealed_session,
        {"session/cameras.mcap": (*MCAP, *RECORDING)},
        read=_read_session,
        command=lambda given, out: ["export", str(given / _SESSION), "--format", "ros2", "--output", str(out / "bag")],
        quick=True,
    ),
    Kind(
        "cut session",
        session_sample.cut_session,
        {
            "session/signals.mcap": (*BINARY, *MCAP, *RECORDING),
            "session/cameras.mcap": (*BINARY, *MCAP, *RECORDING),
        },
        read=lambda folder: recover_session(folder / _SESSION),
        command=lambda given, out: ["recover", str(given / _SESSION)],
        places=_PLACES_OF_RECORDINGS,
    ),
    _surface("STL", "body.stl", samples.stl, (*BINARY, *STL)),
    _surface("STL, text", "body.stl", samples.stl_text, _IN_TEXT),
    _surface("PLY", "body.ply", samples.ply, (*BINARY, *PLY)),
    _surface("PLY, text", "body.ply", samples.ply_text, (*_IN_TEXT, *PLY)),
    _surface("OBJ", "body.obj", samples.obj, _IN_TEXT),
    _surface("VTP", "body.vtp", samples.vtp, (*_IN_TEXT, *VTP)),
    _surface("VTP, by LZ4", "body.vtp", surface_samples.vtp_packed, (*BINARY, *VTP)),
    _surface("VTP, by LZMA", "body.vtp", surface_samples.vtp_lzma, (*BINARY, *VTP)),
    _surface("PLY, strips", "body.ply", surface_samples.ply_of_strips, (*BINARY, *PLY)),
    Kind(
        "tensile record",
        samples.uniaxial,
        {"record.csv": (*TEXT, *TABLE)},
        read=_fit_uniaxial,
        command=_uniaxial("record.csv"),
        quick=True,
    ),
    *IMPORT_KINDS,
    *(_export_of_machine(layout) for layout in TEXT_LAYOUTS),
    Kind(
        "export, rewritten",
        lambda folder: samples.machine_export(folder, "testXpert"),
        {"record.csv": REWRITTEN},
        read=_fit_gel,
        command=_uniaxial("record.csv"),
        quick=True,
    ),
    Kind(
        "export, spreadsheet",
        samples.machine_workbook,
        {"record.xlsx": SHEETS},
        read=lambda folder: _fit_uniaxial(folder, "record.xlsx"),
        command=_uniaxial("record.xlsx"),
        quick=True,
    ),
    Kind(
        "sealed case",
        samples.sealed_cases,
        {"cases/two/pull/experiment.toml": TOML, "cases/two/pull/observations.csv": TABLE},
        read=lambda folder: [read_case(folder / "cases" / name) for name in case_names(folder / "cases")],
        command=lambda given, out: ["benchmark", "run", str(given / "cases"), "--out", str(out / "answers")],
    ),
    Kind(
        "answers",
        samples.benchmark,
        {"answers/one.json": (*TEXT, *JSON)},
        read=_read_benchmark,
        command=_score,
        quick=True,
        changes=frozenset({OPENINGS_FILE}),
    ),
    Kind(
        "keys",
        samples.benchmark,
        {"keys/two.toml": (*TEXT, *TOML)},
        read=_read_benchmark,
        command=_score,
        quick=True,
        changes=frozenset({OPENINGS_FILE}),
    ),
    Kind(
        "count of openings",
        samples.opened_benchmark,
        {"keys/openings.txt": TEXT},
        read=_read_benchmark,
        command=_score,
        quick=True,
    ),
    Kind(
        "study's kept row",
        samples.outcome,
        {"*.json": (*TEXT, *JSON)},
        read=lambda folder: OutcomeStore(folder).read(samples.KnownCase()),
    ),
    Kind(
        "results of faults",
        samples.fault_results,
        {"results.jsonl": (*TEXT, *JSON_LINES)},
        read=lambda folder: read_results(folder / "results.jsonl", seed=1),
        command=_faults,
    ),
    Kind(
        "results of coverage",
        samples.coverage_results,
        {"sets.jsonl": (*TEXT, *JSON_LINES)},
        read=lambda folder: result_lines.read_results(coverage.Outcome, folder / "sets.jsonl"),
    ),
    Kind(
        "images of a camera",
        samples.image_sequence,
        {"image00.png": BINARY, "image01.png": BINARY},
        read=_play_images,
    ),
)  # fmt: skip
