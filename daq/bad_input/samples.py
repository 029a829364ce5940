"""Valid files of every kind, small ones: what damage is done to."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from daq.bad_input.machine_exports import TEXT_LAYOUTS, gel_test, workbook
from daq.calibration_files.outcome import Figure, Kind
from daq.calibration_files.record import FORMAT, CalibrationRecord, Serial
from daq.calibration_files.results import ForceResult, StreamLatency, TimeResult
from daq.faults.campaign import keep
from daq.faults.trial import Outcome as FaultOutcome
from daq.files.toml_tables import toml_text
from daq.plans import journal_path
from daq.rig import write_rig
from daq.virtual_rig.layout import SPECIMEN, Addresses, rig_description
from daq.virtual_rig.rendering.scene import flea2_pair
from estimator.blind.scoring.keys import open_keys
from estimator.effects.force.force_bias import ForceBias
from estimator.effects.motion.gripper_slip import GripperSlip
from estimator.experiment import Experiment, Phantom, SensorNoise, write_experiment
from estimator.fit import coverage
from estimator.geometry.shapes import block_surface, sphere_surface
from estimator.result_lines import append_result
from estimator.studies.case import Outcome, Parametric, Row
from estimator.studies.store import OutcomeStore
from estimator.surfaces.surface import Surface
from estimator.surfaces.writing import write_ply, write_stl

_ADDRESSES = Addresses(1, 2, 3, 4, 5, 6, ("tcp://127.0.0.1:7", "tcp://127.0.0.1:8"))
_STEPS = 6
_STEP_M = 2e-3


def rig(folder: Path) -> None:
    """Write ``rig.toml`` with its stereo calibration."""
    flea2_pair().save(folder / "stereo.toml")
    write_rig(rig_description(_ADDRESSES, folder / "stereo.toml"), folder / "rig.toml")


def plan(folder: Path) -> None:
    """Write ``plan.toml`` and its journal, a table and a function that it names, and a rig."""
    rig(folder)
    trajectory_table(folder)
    (folder / "mine.py").write_text(
        "from robot_drivers.protocols import Pose\n\n\ndef sway(way):\n    return Pose((0.01 * way, 0.0, 0.0))\n",
        encoding="utf-8",
    )
    (folder / "plan.toml").write_text(
        'format = "retraction-plan/1"\nsessions = "sessions"\nname = "{date}_{phantom}_{trial:02d}_{repeat}"\n'
        'operator = "N. N."\nfirst_order = 1\n\n[[trials]]\ntrajectory = "pull"\nrepeat = 2\nsteps = 5\n'
        "step_length_m = 0.001\nrounds = 1\nholds_s = [3.0, 8.0]\nsettle_s = 0.5\n\n[[trials]]\n"
        'trajectory = "table.csv"\nspeed_m_s = 0.004\n\n[[trials]]\ntrajectory = "mine.py:sway"\n'
        'steps = 4\nnotes = "slow"\n',
        encoding="utf-8",
    )
    journal = {"0123456789ab.1": "sessions/one", "0123456789ab.2": "sessions/two"}
    journal_path(folder / "plan.toml").write_text(json.dumps(journal, indent=2), encoding="utf-8")


def trajectory_table(folder: Path) -> None:
    """Write ``table.csv`` and a rig."""
    rig(folder)
    rows = [f"{1e-3 * row},0.0,{1e-4 * row},0.0,0.0,{0.01 * row},0.5,0.8,hold" for row in range(1, 9)]
    header = "x_m,y_m,z_m,rx_rad,ry_rad,rz_rad,settle_s,measure_s,phase"
    (folder / "table.csv").write_text("\n".join([header, *rows, ""]), encoding="utf-8")


def experiment(folder: Path) -> None:
    """Write one experiment, ``pull``, of a block."""
    write_experiment(_retraction("pull", 1), folder / "pull")


def experiment_of_surface(folder: Path) -> None:
    """Write one experiment, ``pull``, of a body given as a surface."""
    write_stl(block_surface(SPECIMEN.phantom.size_m, (3, 3, 1)), folder / "body.stl")
    body = Phantom("surface", SPECIMEN.phantom.size_m, folder / "body.stl")
    write_experiment(replace(_retraction("pull", 1), phantom=body), folder / "pull")


def case(folder: Path) -> None:
    """Write a case of two experiments."""
    for order, name in enumerate(("pull", "again"), start=1):
        write_experiment(_retraction(name, order), folder / "case" / name)


def sealed_cases(folder: Path) -> None:
    """Write two cases of a benchmark, each of one experiment."""
    for name in ("one", "two"):
        write_experiment(_retraction("pull", 1), folder / "cases" / name / "pull")


def calibration(folder: Path) -> None:
    """Write kept calibrations of a force sensor and of the streams' times, and a rig."""
    rig(folder)
    six = (0.1, 0.2, 0.3, 0.01, 0.02, 0.03)
    curve = ((-0.01, 0.0, 0.01), (0.2, 0.9, 0.3), (0.01, 0.01, 0.01))
    results: Mapping[Kind, object] = {
        "force": ForceResult(0.35, 0.001, (0.0, 0.0, 0.06), (1e-4, 1e-4, 1e-4), six, six, six),
        "time": TimeResult("sway", (StreamLatency("force sensor", 0.01, 1e-4, *curve),)),
    }
    for kind, result in results.items():
        record = CalibrationRecord(
            FORMAT,
            kind,
            "virtual rig",
            "2026-05-04T14:32:10+00:00",
            "2027-05-04T14:32:10+00:00",
            "accepted",
            (Serial("force_sensor", "FT12345"),),
            (Figure("rms", 0.02, "N", most=0.05),),
            result,
        )
        (folder / f"{kind}_2026-05-04_143210.toml").write_text(toml_text(record, folder), encoding="utf-8")


def stl(folder: Path) -> None:
    """Write a binary STL file."""
    write_stl(_body(), folder / "body.stl")


def stl_text(folder: Path) -> None:
    """Write an STL file of text."""
    facets = [
        f"facet normal 0 0 0\n outer loop\n{corners}\n endloop\nendfacet"
        for triangle in _body().corners.tolist()
        for corners in ["\n".join(f"  vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in triangle)]
    ]
    (folder / "body.stl").write_text("\n".join(["solid body", *facets, "endsolid body\n"]), encoding="utf-8")


def ply(folder: Path) -> None:
    """Write a binary PLY file."""
    write_ply(_body(), folder / "body.ply")


def ply_text(folder: Path) -> None:
    """Write a PLY file of text."""
    body = _body()
    lines = [
        "ply\nformat ascii 1.0",
        f"element vertex {len(body.vertices)}\nproperty double x\nproperty double y\nproperty double z",
        f"element face {len(body.triangles)}\nproperty list uchar int vertex_indices\nend_header",
        *(" ".join(map(repr, vertex)) for vertex in body.vertices.tolist()),
        *(f"3 {a} {b} {c}" for a, b, c in body.triangles.tolist()),
    ]
    (folder / "body.ply").write_text("\n".join([*lines, ""]), encoding="utf-8")


def obj(folder: Path) -> None:
    """Write an OBJ file."""
    body = _body()
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in body.vertices.tolist()]
    lines += [f"f {a + 1}/1/1 {b + 1}/1/1 {c + 1}/1/1" for a, b, c in body.triangles.tolist()]
    (folder / "body.obj").write_text("\n".join([*lines, ""]), encoding="utf-8")


def vtp(folder: Path) -> None:
    """Write a VTP file of text."""
    body = _body()
    points = " ".join(map(repr, body.vertices.ravel().tolist()))
    nodes = " ".join(map(str, body.triangles.ravel().tolist()))
    ends = " ".join(str(3 * (number + 1)) for number in range(len(body.triangles)))
    (folder / "body.vtp").write_text(
        '<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" '
        f'header_type="UInt32">\n<PolyData>\n<Piece NumberOfPoints="{len(body.vertices)}" '
        f'NumberOfPolys="{len(body.triangles)}">\n<Points>\n<DataArray type="Float64" NumberOfComponents="3" '
        f'format="ascii">{points}</DataArray>\n</Points>\n<Polys>\n<DataArray type="Int64" Name="connectivity" '
        f'format="ascii">{nodes}</DataArray>\n<DataArray type="Int64" Name="offsets" format="ascii">{ends}'
        "</DataArray>\n</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n",
        encoding="utf-8",
    )


def uniaxial(folder: Path) -> None:
    """Write the record of a tensile test."""
    stretch = np.linspace(1.0, 1.6, 25)
    stress_kPa = 10.0 * (stretch - stretch**-2)
    rows = [f"{strain:.6f},{stress:.6f}" for strain, stress in zip(stretch - 1, stress_kPa, strict=True)]
    facts = ["Specimen,A1", "Strain,crosshead travel", "Initial height (mm),20.0"]
    (folder / "record.csv").write_text(
        "\n".join([*facts, "Engineering strain (-),Engineering stress (kPa)", *rows, ""]), encoding="utf-8"
    )


def machine_export(folder: Path, layout: str) -> None:
    """Write the record of a compression test as a testing machine's program does."""
    text = TEXT_LAYOUTS[layout](gel_test("compression", noise=1e-3, rows=41))
    (folder / "record.csv").write_text(text, encoding="utf-8")


def machine_workbook(folder: Path) -> None:
    """Write a spreadsheet with the tests of two specimens."""
    (folder / "record.xlsx").write_bytes(workbook(gel_test(noise=1e-3, rows=41), specimens=2))


def benchmark(folder: Path) -> None:
    """Write answers and keys of two cases."""
    (folder / "answers").mkdir()
    (folder / "keys").mkdir()
    modulus, ratio = {"value": 15e3, "std": 10.0}, {"value": 0.45, "std": 0.001}
    material = {"youngs_modulus": modulus, "poisson_ratio": ratio}
    for name, label in (("one", GripperSlip.label), ("two", ForceBias.label)):
        answer = {
            "verdict": [label],
            "probabilities": {label: 0.9, "none": 0.1},
            "credible_set": [label],
            "gap": {"closure_held_out": 0.8},
            "where": {"blocks": {"gripper": 0.7, "sensor": 0.3}, "centre": [0.01, 0.02, 0.0]},
            "material": {"before": material, "after": material},
            "seconds": 30.5,
        }
        (folder / "answers" / f"{name}.json").write_text(json.dumps(answer, indent=1), encoding="utf-8")
        (folder / "keys" / f"{name}.toml").write_text(
            f'effects = ["{label}"]\nyoungs_modulus = 15000.0\npoisson_ratio = 0.45\n\n[where]\n'
            'centre = [0.01, 0.02, 0.0]\nradius = 0.01\n\n[generator]\nlevel = "clear"\nsigma = [21.5]\n',
            encoding="utf-8",
        )


def opened_benchmark(folder: Path) -> None:
    """Write answers and keys of two cases, whose keys were opened twice."""
    benchmark(folder)
    for _ in range(2):
        open_keys(folder / "keys", "scored answers")


def fault_results(folder: Path) -> None:
    """Write ``results.jsonl``, the results of two runs of the fault campaign."""
    for run in range(2):
        keep(
            folder / "results.jsonl",
            FaultOutcome(
                fault="EGM falls silent",
                seed=1,
                run=run,
                instant_s=1.5,
                moved_for_s=0.02,
                way_m=0.004,
                acknowledged={"force": 100, "robot": 90},
                found={"force": 101, "robot": 91},
                told="the robot has fallen silent",
                state="sealed",
                problems=("the robot has fallen silent",),
                resets={"robot": 0},
                late_s={"robot": 0.002},
                next_failure="",
                load=1.0,
                seconds=9.0,
            ),
        )


def coverage_results(folder: Path) -> None:
    """Write ``sets.jsonl``, the outcomes of three data sets of the coverage, the last of which failed."""
    truth = {"youngs_modulus": 1e4, "poisson_ratio": 0.45}
    intervals = {"youngs_modulus": (9e3, 1.1e4), "poisson_ratio": (0.44, 0.46)}
    for seed in range(2):
        append_result(folder / "sets.jsonl", coverage.Outcome(seed, truth, truth, intervals, 1.0))
    append_result(folder / "sets.jsonl", coverage.Outcome(2, truth, {}, {}, float("nan"), "no convergence"))


def image_sequence(folder: Path) -> None:
    """Write three images that a camera of the driver ``opencv`` may play."""
    shades = np.arange(48 * 64, dtype=np.uint8).reshape(48, 64)
    for number in range(3):
        (folder / f"image{number:02d}.png").write_bytes(cv2.imencode(".png", shades)[1].tobytes())


class KnownCase(Parametric):
    """A case of a study that is known already."""

    name = "known"

    def __repr__(self) -> str:
        return "KnownCase()"

    def run(self) -> Row:
        """Return nothing: its outcome is kept."""
        return {}


def outcome(folder: Path) -> None:
    """Write the kept outcome of a case of a study."""
    row: Row = {"youngs_modulus": 15e3, "poisson_ratio": 0.45, "seconds": 2.5, "remark": "stopped early"}
    OutcomeStore(folder).write(KnownCase(), Outcome(row))


def views(folder: Path) -> None:
    """Write two small pairs of images, in which there is no board, and a rig."""
    rig(folder)
    shades = np.arange(48 * 64, dtype=np.uint8).reshape(48, 64)
    for side in ("left", "right"):
        for number in range(2):
            (folder / f"{side}{number}.png").write_bytes(cv2.imencode(".png", shades)[1].tobytes())


def _body() -> Surface:
    return sphere_surface(0.03, 1)


def _retraction(name: str, order: int) -> Experiment:
    """Return a pull of a block in which the beads follow the gripper by their share of the way."""
    rest = np.array(SPECIMEN.fiducials_m)[:4]
    way = _STEP_M * np.arange(_STEPS + 1)
    moved = np.outer(way, [1.0, 0.0, 0.0])
    share: Sequence[float] = [0.2, 0.4, 0.6, 0.8]
    return Experiment(
        name=name,
        phantom_id="P07",
        order=order,
        phantom=SPECIMEN.phantom,
        anchors=SPECIMEN.anchors,
        grasp=SPECIMEN.grasp,
        trajectory_kind="pull",
        environment=SPECIMEN.environment,
        sensor=SensorNoise(0.02, 5e-4, 5e-5, 3e-5),
        fiducials_rest=rest,
        time=np.linspace(0.0, 9.0, len(way)),
        phase=("hold",) * len(way),
        step=np.arange(len(way)),
        position=np.array(SPECIMEN.grasp.centre) + moved,
        quaternion_wxyz=Rotation.identity(len(way)).as_quat(scalar_first=True),
        wrench=np.outer(way / way[-1], [-3.0, 0.1, 0.2, 0.002, 0.01, 0.03]),
        fiducials=rest + np.multiply.outer(way, [1.0, 0.0, 0.1])[:, None, :] * np.array(share)[None, :, None],
    )
