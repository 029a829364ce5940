import json
from pathlib import Path

import numpy as np
import pytest

from daq.cli import main
from daq.cli.sessions.record import chosen_trial
from daq.recording.folder import SessionInfo, read_info, write_info
from daq.rig import write_rig
from daq.trajectories import PULL
from daq.virtual_rig.layout import Addresses, rig_description


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    """Return exit status, standard output and standard error of one call."""
    status = main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return status, out, err


def one_line(text: str) -> bool:
    return text.startswith("retract: ") and text.count("\n") == 1


@pytest.fixture
def cut_session(tmp_path: Path) -> Path:
    """A session whose files were cut off right after their beginning."""
    folder = tmp_path / "session"
    folder.mkdir()
    write_info(folder, SessionInfo("test", "P1", 1))
    for name in ("signals.mcap", "cameras.mcap"):
        (folder / name).write_bytes(b"\x89MCAP0\r\n" + bytes(7))
    return folder


@pytest.mark.parametrize(
    "verb", ["demo", "devices", "record", "recover", "export", "simulate", "estimate", "uniaxial"]
)
def test_every_verb_has_help_with_examples(capsys: pytest.CaptureFixture[str], verb: str) -> None:
    with pytest.raises(SystemExit, match="0"):
        main([verb, "--help"])
    out = capsys.readouterr().out
    assert f"retract {verb}" in out
    assert "examples:" in out
    assert "--json" in out


@pytest.mark.parametrize(
    "arguments",
    [
        ("devices", "nowhere.toml"),
        ("record", "nowhere.toml"),
        ("recover", "nowhere"),
        ("export", "nowhere", "--output", "experiment"),
        ("estimate", "nowhere"),
        ("uniaxial", "nowhere.csv"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_a_missing_file_ends_with_one_line_and_status_2(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = run(capsys, *arguments)
    assert status == 2
    assert out == ""
    assert one_line(err)
    assert "nowhere" in err


def test_a_wrong_option_ends_with_status_2(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["record", "lab.toml", "--trajectory", "push"])
    assert "invalid choice" in capsys.readouterr().err


def test_recover_seals_and_tells_in_json_alone(capsys: pytest.CaptureFixture[str], cut_session: Path) -> None:
    status, out, err = run(capsys, "recover", cut_session, "--json")
    assert (status, err) == (0, "")
    told = json.loads(out)
    assert (told["session"], told["samples"], told["dropped_bytes"]) == (str(cut_session), {}, 14)
    assert told["lost"] == {}
    assert read_info(cut_session).state == "recovered"
    status, _, err = run(capsys, "recover", cut_session)
    assert status == 2
    assert "recovered already" in err


def test_an_interrupt_ends_with_one_line_and_status_130(
    capsys: pytest.CaptureFixture[str], cut_session: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(folder: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("daq.cli.sessions.recover.recover_session", interrupted)
    status, out, err = run(capsys, "recover", cut_session)
    assert (status, out, err) == (130, "", "retract: interrupted\n")


def test_a_folder_that_cannot_be_written_is_told_in_one_line(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    status, _, err = run(capsys, "demo", "--output", tmp_path / "file" / "demo")
    assert status == 2
    assert one_line(err)


def test_devices_that_do_not_answer_are_told_one_by_one(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    nobody = Addresses(1, 1, 1, 1, 1, 0, ("tcp://127.0.0.1:1", "tcp://127.0.0.1:1"))
    write_rig(rig_description(nobody, tmp_path / "stereo.toml"), tmp_path / "rig.toml")
    status, out, _ = run(capsys, "devices", tmp_path / "rig.toml", "--json")
    assert status == 1
    devices = json.loads(out)["devices"]
    assert list(devices) == ["force sensor", "robot", "camera left", "camera right"]
    for told in devices.values():
        assert [(check["name"], check["passed"]) for check in told["checks"]] == [("reachable", False)]


def test_uniaxial_finds_the_modulus_of_a_made_up_test(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    stretch = 1.0 + np.linspace(0.0, 1.0, 60)
    stress = 20e3 / 3 * (stretch - stretch**-2)  # incompressible Neo-Hookean, E = 20 kPa
    rows = "\n".join(f"{s - 1:.6f},{p:.4f}" for s, p in zip(stretch, stress, strict=True))
    path = tmp_path / "test.csv"
    path.write_text(f"strain (-),stress (Pa)\n{rows}\n")
    status, out, _ = run(capsys, "uniaxial", path, "--json", "--output", tmp_path / "report")
    assert status == 0
    assert json.loads(out)["laws"]["neo_hookean"]
    assert (tmp_path / "report" / "uniaxial.html").is_file()


def test_uniaxial_asks_for_what_a_file_leaves_open_and_tells_what_it_supposed(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    stretch = 1.0 - np.linspace(0.0, 0.4, 60)
    load_N = 20e3 / 3 * (stretch**-2 - stretch) * 1e-4
    rows = "\n".join(f"{20 * (1 - s):.6f},{f:.6f}" for s, f in zip(stretch, load_N, strict=True))
    path = tmp_path / "test.csv"
    path.write_text(f"Compression (mm),Load (N)\n{rows}\n3,2\n")
    for sizes, asked in (
        ([], "--gauge-length"),
        (["--gauge-length", "20 mm"], "--area"),
        (["--area", "1"], "no unit"),
    ):
        status, out, told = run(capsys, "uniaxial", path, *sizes)
        assert (status, out) == (2, "")
        assert asked in told
        assert told.count("\n") == 1
    sizes = ["--gauge-length", "2 cm", "--area", "100 mm²"]
    status, out, _ = run(capsys, "uniaxial", path, *sizes, "--law", "neo_hookean", "--json")
    answer = json.loads(out)
    assert status == 0
    assert answer["laws"]["neo_hookean"]["youngs_modulus"]["value"] == pytest.approx(20e3, rel=1e-3)
    assert answer["mode"] == "compression"
    assert "Compression (mm)" in answer["mode_from"]
    assert "line 62" in answer["left_out"][0]
    assert answer["assumed"] == []


class Options:
    """What argparse would give for ``record`` without options."""

    trajectory = "pull"
    repeat = 1
    steps = step_length = angle = return_steps = speed = settle = measure = None
    hold: list[float] = []  # noqa: RUF012 - read only


def test_record_changes_nothing_of_the_standard_unless_asked(tmp_path: Path) -> None:
    assert chosen_trial(Options()).lay_out(tmp_path) == PULL.trajectory()


def test_record_takes_millimetres_and_degrees() -> None:
    options = Options()
    options.trajectory, options.steps, options.step_length, options.angle = "twist_and_pull", 5, 1.5, 30.0
    chosen = chosen_trial(options)
    assert (chosen.trajectory, chosen.steps) == ("twist_and_pull", 5)
    assert chosen.step_length_m == pytest.approx(0.0015)
    assert chosen.angle_rad == pytest.approx(np.pi / 6)
