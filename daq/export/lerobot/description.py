"""What describes a LeRobot dataset: ``meta/info.json``, ``stats.json``, ``tasks.parquet`` and the rows of its episodes.

The published description of v3.0 names ``meta/tasks.jsonl``; the library writes and reads ``meta/tasks.parquet``.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from daq.export.lerobot.data_files import CHUNK_SIZE, DATA_PATH, FILE, MOST_DATA_MB, Columns, Features
from daq.export.lerobot.statistics import ImageStatistics, Statistics, joined, statistics
from daq.export.lerobot.videos import MOST_VIDEO_MB, VIDEO_PATH

_VERSION = "v3.0"


@dataclass(frozen=True, slots=True, eq=False)
class Episode:
    """One episode in its file: its row of the description but for statistics, its columns, its images' values."""

    row: dict[str, Any]
    columns: Columns
    images: dict[str, ImageStatistics]


def write_description(
    folder: Path,
    features: Features,
    episodes: Sequence[Episode],
    tasks: Sequence[str],
    rate_and_robot: tuple[int, str],
) -> None:
    """Write everything beside the frames.

    Parameters
    ----------
    rate_and_robot : frames a second, and the robot's model, empty where it is not known
    """
    fps, robot = rate_and_robot
    here = {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
    told = [one.row | _flat(_statistics([one])) | here for one in episodes]
    file = folder / "meta" / "episodes" / FILE.format(chunk_index=0, file_index=0)
    pq.write_table(pa.Table.from_pylist(told), file)
    _write_tasks(folder / "meta" / "tasks.parquet", tasks)
    _write_json(folder / "meta" / "stats.json", _plain(_statistics(episodes)))
    count = sum(one.row["length"] for one in episodes)
    info = {
        "codebase_version": _VERSION,
        "robot_type": robot or None,
        "total_episodes": len(episodes),
        "total_frames": count,
        "total_tasks": len(tasks),
        "chunks_size": CHUNK_SIZE,
        "data_files_size_in_mb": MOST_DATA_MB,
        "video_files_size_in_mb": MOST_VIDEO_MB,
        "fps": fps,
        "splits": {"train": f"0:{len(episodes)}"},
        "data_path": DATA_PATH,
        "video_path": VIDEO_PATH if any(one["dtype"] == "video" for one in features.values()) else None,
        "features": features,
    }
    _write_json(folder / "meta" / "info.json", info)


def _write_tasks(file: Path, tasks: Sequence[str]) -> None:
    """Write the texts as the index of a table of pandas, where the library looks for them."""
    kinds = (("task_index", "int64", "int64"), ("task", "unicode", "object"))
    described = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [
            {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": numpy, "metadata": None}
            for name, kind, numpy in kinds
        ],
        "pandas_version": "2.0.0",
    }
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), "task": pa.array(tasks)})
    pq.write_table(table.replace_schema_metadata({"pandas": json.dumps(described)}), file)


def _statistics(episodes: Sequence[Episode]) -> dict[str, Statistics]:
    """Return the statistics of the frames of episodes, by column."""
    found = {name: statistics(values) for name, values in joined([one.columns for one in episodes]).items()}
    for name in episodes[0].images:
        together = ImageStatistics()
        for one in episodes:
            together.with_all_of(one.images[name])
        found[f"observation.images.{name}"] = together.result()
    return found


def _flat(found: dict[str, Statistics]) -> dict[str, Any]:
    return {
        f"stats/{name}/{what}": values.tolist() for name, one in found.items() for what, values in one.items()
    }


def _plain(found: dict[str, Statistics]) -> dict[str, Any]:
    return {name: {what: values.tolist() for what, values in one.items()} for name, one in found.items()}


def _write_json(file: Path, content: dict[str, Any]) -> None:
    file.write_text(json.dumps(content, indent=4, ensure_ascii=False) + "\n", encoding="utf-8")
