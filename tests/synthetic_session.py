"""A session folder written without devices: known motion, known load, clocks with delay and drift."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path

import numpy as np

from daq.frames import compose, inverse, rotation
from daq.recording.folder import SessionInfo, write_info
from daq.recording.mcap import schemas
from daq.recording.mcap.log import McapLog
from daq.recording.messages.codec import compressed
from daq.recording.messages.rows import EventRows, FrameRows, PoseRows, WrenchRows
from daq.rig import Rig, write_rig
from daq.virtual_rig.layout import FRAMES, SPECIMEN, TOOL, Addresses, rig_description
from daq.virtual_rig.physics.phantom import SpringPhantom
from daq.virtual_rig.rendering.scene import Scene, SceneSettings, flea2_pair
from daq.vision.camera_model import PinholeCamera
from robot_drivers.protocols import Frame, Pose, PoseBlock, WrenchBlock

START_NS = 10**15
WINDOW_S = 1.0
MOVE_S = 0.5
_CHUNK = 100


@cache
def rendered_scene(camera: PinholeCamera, seed: int) -> Scene:
    """Scenes take a second to prepare."""
    return Scene(camera, SceneSettings(phantom_size=SPECIMEN.phantom.size_m), seed)


@dataclass
class SyntheticSession:
    """One second of measuring at each of the gripper's poses, half a second between them.

    Attributes
    ----------
    poses : ``T_tissue_gripper`` of each window
    phantom : what is pulled
    offset : (6,) reading of the unloaded sensor
    noise : (6,) of the readings
    lost : (begin, end) in s of what the force sensor did not deliver
    frame_rate : of both cameras, 1/s
    right_lost : numbers of the right camera's images that never arrived
    """

    poses: Sequence[Pose]
    phantom: SpringPhantom
    offset: np.ndarray = field(default_factory=lambda: np.array([4.0, -7.0, 12.0, 0.3, -0.2, 0.1]))
    noise: np.ndarray = field(default_factory=lambda: np.array([6e-3, 6e-3, 1.3e-2, 3e-4, 3e-4, 2e-4]))
    lost: tuple[float, float] = (0.0, 0.0)
    frame_rate: float = 2.0
    right_lost: tuple[int, ...] = ()
    seed: int = 0

    def write(self, folder: Path) -> Path:
        """Write the folder, unsealed."""
        (folder / "calibration").mkdir(parents=True)
        calibration = folder / "calibration" / "stereo.toml"
        flea2_pair().save(calibration)
        write_rig(self.rig(calibration), folder / "rig.toml")
        write_info(folder, SessionInfo("synthetic", "P1", 1, trajectory={"kind": "twist_and_pull"}))
        self._rng = np.random.default_rng(self.seed)
        with McapLog(folder / "signals.mcap") as signals:
            self._write_events(signals)
            self._write_force(signals)
            self._write_robot(signals)
        with McapLog(folder / "cameras.mcap") as images:
            self._write_images(images)
        return folder

    def rig(self, calibration: Path) -> Rig:
        return rig_description(Addresses(1, 2, 3, 4, 5, 6, ("tcp://a:1", "tcp://b:2")), calibration)

    def _pose_at(self, time_s: float) -> Pose:
        return self.poses[min(int(time_s / (WINDOW_S + MOVE_S)), len(self.poses) - 1)]

    def _window_begin_s(self, row: int) -> float:
        return row * (WINDOW_S + MOVE_S)

    @property
    def _duration_s(self) -> float:
        return len(self.poses) * (WINDOW_S + MOVE_S)

    def _received(self, time_s: np.ndarray, delay_s: float) -> np.ndarray:
        late = self._rng.exponential(delay_s, len(time_s))
        return START_NS + np.rint(np.maximum.accumulate(time_s + late) * 1e9).astype(np.int64)

    def _write_events(self, log: McapLog) -> None:
        rows = EventRows(log.add_channel("/events", schemas.EVENT))
        for row in range(len(self.poses)):
            begin_ns = START_NS + round(self._window_begin_s(row) * 1e9)
            begin = {"event": "measure_begin", "row": row, "number": row, "phase": "hold"}
            log.append(rows.pack(begin, begin_ns, 2 * row))
            log.append(
                rows.pack({"event": "measure_end", "row": row}, begin_ns + round(WINDOW_S * 1e9), 2 * row + 1)
            )

    def _write_force(self, log: McapLog) -> None:
        time_s = np.arange(0.0, self._duration_s, 1e-3)
        load_at = cache(self._load)  # the gripper stands most of the time
        load = np.array([load_at(self._pose_at(moment)) for moment in time_s])
        block = WrenchBlock(
            counter=np.arange(len(time_s)),
            device_time_s=time_s * (1 + 40e-6),
            host_time_ns=self._received(time_s, 100e-6),
            status=np.zeros(len(time_s), dtype=np.int64),
            usable=np.ones(len(time_s), dtype=np.bool_),
            wrench=load + self._rng.standard_normal(load.shape) * self.noise,
        )
        kept = (time_s < self.lost[0]) | (time_s >= self.lost[1])
        rows = WrenchRows(
            log.add_channel("/force/wrench", schemas.WRENCH),
            log.add_channel("/force/device", schemas.DEVICE_STAMP),
            "force_sensor",
        )
        _append(log, rows, WrenchBlock(*(getattr(block, f.name)[kept] for f in fields(block))))

    def _load(self, pose: Pose) -> np.ndarray:
        """The sensor's load from the equilibrium of forces and moments about its own origin."""
        tissue = self.phantom.solve(pose).wrench
        R_tissue_gripper = rotation(pose.quaternion_wxyz).as_matrix()
        T_gripper_sensor = FRAMES.T_gripper_sensor.pose
        R_tissue_sensor = R_tissue_gripper @ rotation(T_gripper_sensor.quaternion_wxyz).as_matrix()
        sensor = R_tissue_gripper @ np.array(T_gripper_sensor.position)
        mass = R_tissue_gripper @ np.array(TOOL.centre_m)
        weight = np.array([0.0, 0.0, -9.81 * TOOL.mass_kg])
        force = tissue[:3] + weight
        torque = tissue[3:] + np.cross(-sensor, tissue[:3]) + np.cross(mass - sensor, weight)
        return np.concatenate([R_tissue_sensor.T @ force, R_tissue_sensor.T @ torque]) + self.offset

    def _write_robot(self, log: McapLog) -> None:
        time_s = np.arange(0.0, self._duration_s, 0.004032)
        T_gripper_tool = inverse(FRAMES.T_tool_gripper.pose)
        tool_at = cache(
            lambda T_tissue_gripper: compose(
                compose(FRAMES.T_base_tissue.pose, T_tissue_gripper), T_gripper_tool
            )
        )
        tools = [tool_at(self._pose_at(moment)) for moment in time_s]
        position = np.array([tool.position for tool in tools])
        rows = PoseRows(
            log.add_channel("/robot/pose", schemas.POSE),
            log.add_channel("/robot/joints", schemas.JOINT_STATE),
            log.add_channel("/robot/device", schemas.DEVICE_STAMP),
            "robot_base",
        )
        block = PoseBlock(
            counter=np.arange(len(time_s)),
            device_time_s=100.0 + time_s * (1 - 25e-6),
            host_time_ns=self._received(time_s, 300e-6),
            position=position + self._rng.normal(0.0, 1e-6, position.shape),
            quaternion_wxyz=np.array([tool.quaternion_wxyz for tool in tools]),
            joints=np.zeros((len(time_s), 6)),
            moving=np.zeros(len(time_s), dtype=np.bool_),
        )
        _append(log, rows, block)

    def _write_images(self, log: McapLog) -> None:
        pair = flea2_pair()
        for side, (name, camera) in enumerate((("left", pair.left), ("right", pair.right))):
            scene = rendered_scene(camera, side)
            rows = FrameRows(
                log.add_channel(f"/camera/{name}/image", schemas.COMPRESSED_IMAGE),
                log.add_channel(f"/camera/{name}/image_raw", schemas.IMAGE),
                log.add_channel(f"/camera/{name}/device", schemas.DEVICE_STAMP),
                f"camera_{name}",
            )
            time_s = np.arange(0.05, self._duration_s, 1 / self.frame_rate)
            received = self._received(time_s, 5e-3)
            for number, moment in enumerate(time_s):
                if name == "right" and number in self.right_lost:
                    continue
                image = scene.render(self.phantom.solve(self._pose_at(moment)).beads, number)
                frame = Frame(number, 50.0 + moment, int(received[number]), "mono8", image)
                log.append(rows.pack(compressed(frame), number))


def _append(log: McapLog, rows: WrenchRows | PoseRows, block: WrenchBlock | PoseBlock) -> None:
    """In chunks, as a recorder does."""
    for first in range(0, len(block), _CHUNK):
        part = replace(
            block, **{f.name: getattr(block, f.name)[first : first + _CHUNK] for f in fields(block)}
        )
        log.append(rows.pack(part, first))  # type: ignore[arg-type]  # rows and block are of one kind
