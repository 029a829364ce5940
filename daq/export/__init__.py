"""What a session is handed on as: an experiment folder, tables, a rosbag2 folder; with where it comes from."""

from daq.export.session_export import (
    ExportedTables,
    Provenance,
    Rejection,
    StreamProvenance,
    export_experiment,
    export_ros2,
    export_tables,
    sealed_recording,
)

__all__ = [
    "ExportedTables",
    "Provenance",
    "Rejection",
    "StreamProvenance",
    "export_experiment",
    "export_ros2",
    "export_tables",
    "sealed_recording",
]
