"""What a session is handed on as: an experiment folder, tables, a rosbag2, a LeRobot dataset, an RO-Crate."""

from daq.export.ro_crate.publication import Publication
from daq.export.session_export import (
    ExportedTables,
    Provenance,
    Rejection,
    StreamProvenance,
    export_experiment,
    export_lerobot,
    export_ro_crate,
    export_ros2,
    export_tables,
    sealed_recording,
)

__all__ = [
    "ExportedTables",
    "Provenance",
    "Publication",
    "Rejection",
    "StreamProvenance",
    "export_experiment",
    "export_lerobot",
    "export_ro_crate",
    "export_ros2",
    "export_tables",
    "sealed_recording",
]
