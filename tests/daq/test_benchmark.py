from pathlib import Path

from daq.virtual_rig.benchmark import run
from daq.virtual_rig.load import Load


def test_the_benchmark_counts_measures_and_provokes_a_stop(tmp_path: Path) -> None:
    result = run(1.0, tmp_path, Load(force_rate_hz=1000, frames_per_s=4.0, colour=True))
    assert set(result.streams) == {"force", "robot", "camera left", "camera right"}
    assert result.streams["force"].recorded > 1000
    assert result.streams["force"].missing == result.dropped == 0
    assert 0.0 < result.cpu_share < 2.0
    assert result.memory_mib[2] >= result.memory_mib[1] > 50.0
    assert result.reaction_s is not None
    assert result.reaction_s >= 0.0
    assert "% of one core" in str(result)
