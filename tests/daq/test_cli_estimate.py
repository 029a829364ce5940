"""``retract estimate``: what its options ask the fit for, and how wrong ones are answered."""

import argparse
from dataclasses import replace

import pytest
from synthetic_diagnoses import small_experiment

from daq.cli import main
from daq.cli.estimation import estimate
from daq.cli.estimation.known import with_noise_of
from estimator.errors import InputError
from estimator.fit.nuisances import USUAL
from estimator.fit.settings import FitSettings
from estimator.inference.free_parameter import NormalPrior as Prior


def settings(*options: str) -> FitSettings:
    parser = argparse.ArgumentParser()
    estimate.add_parser(parser.add_subparsers())
    return estimate.settings_of(parser.parse_args(["estimate", *options, "somewhere"]))


def test_without_options_the_fit_is_the_default_one() -> None:
    found, default = settings(), FitSettings()
    assert [p.name for p in found.free] == [p.name for p in default.free]
    assert found.nuisances == default.nuisances == USUAL
    assert (found.objective, found.loss, found.intervals) == ("likelihood", default.loss, "linear")


def test_options_reach_the_fit() -> None:
    found = settings(
        *("--law", "yeoh2", "--fix", "poisson_ratio=0.49", "--bounds", "c2=-0.1:1"),
        *("--prior", "youngs_modulus=15000+-2e3", "--loss", "huber", "--profile", "--nuisances", "tare"),
    )
    assert found.law.name == "yeoh2"
    assert found.fixed == {"poisson_ratio": 0.49}
    assert found.bounds == {"c2": (-0.1, 1.0)}
    assert found.priors == {"youngs_modulus": Prior(15e3, 2e3)}
    assert found.loss.name == "huber"
    assert found.intervals == "profile"
    assert found.nuisances == {"tare"}
    assert [parameter.name for parameter in found.free] == ["youngs_modulus", "c2"]


def test_a_prior_that_is_none_takes_the_usual_one_away() -> None:
    usual, flat = settings(), settings("--prior", "poisson_ratio=none")
    assert [one.prior is None for one in usual.free] == [True, False]
    assert [one.prior is None for one in flat.free] == [True, True]


def test_a_stated_noise_stands_in_for_that_of_the_file() -> None:
    parser = argparse.ArgumentParser()
    estimate.add_parser(parser.add_subparsers())
    given = ["--noise", "force_std=0.5", "--noise", "tz=1e-3"]
    options = parser.parse_args(["estimate", *given, "somewhere"])
    experiment = small_experiment()
    stated = replace(experiment.sensor, by_channel={"fx": 0.1, "tx": 0.2})
    (found,) = with_noise_of(options, [replace(experiment, sensor=stated)])
    assert found.sensor.force_std == 0.5
    assert found.sensor.torque_std == experiment.sensor.torque_std
    assert found.sensor.by_channel == {"tx": 0.2, "tz": 1e-3}


@pytest.mark.parametrize(("text", "complaint"), [("wind=1", "no sensor's"), ("force_std=-1", "is above 0")])
def test_a_noise_that_no_sensor_has_is_refused(text: str, complaint: str) -> None:
    parser = argparse.ArgumentParser()
    estimate.add_parser(parser.add_subparsers())
    options = parser.parse_args(["estimate", "--noise", text, "somewhere"])
    with pytest.raises(InputError, match=complaint):
        with_noise_of(options, [small_experiment()])


def test_no_nuisance_at_all_is_asked_for_by_none() -> None:
    assert settings("--nuisances", "none").nuisances == frozenset()


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--fix", "poisson_ratio"], "--fix poisson_ratio: write it as NAME=NUMBER"),
        (["--prior", "poisson_ratio=0.4"], "--prior poisson_ratio=0.4: write it as NAME=NUMBER+-NUMBER"),
        (["--bounds", "poisson_ratio=low:high"], "write it as NAME=NUMBER:NUMBER"),
        (["--fix", "stiffness=3"], "the neo_hookean law has no parameter 'stiffness'"),
        (["--law", "hooke"], "no law is called 'hooke'; choose one of neo_hookean"),
        (["--nuisances", "wind"], "no nuisance is called 'wind'"),
        (["--objective", "paper", "--profile"], "the paper's objective knows neither"),
    ],
)
def test_wrong_options_end_with_one_line_and_status_two(
    options: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["estimate", "nowhere", *options]) == 2
    said = capsys.readouterr()
    assert complaint in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""


def test_a_budget_is_made_where_it_is_asked_for() -> None:
    assert settings().budget is None
    found = settings(
        "--budget", "--uncertainty", "force_gain=0.005", "--uncertainty", "thickness=0.02"
    ).budget
    assert found is not None
    assert found.sizes == {"force_gain": 0.005, "thickness": 0.02}
    assert found.origins["force_gain"].words == "stated by --uncertainty"


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("force_std", "force"),
        ("tz", "torque"),
        ("z", "bead"),
        ("fiducial_std", "bead"),
        ("position_std", "position"),
    ],
)
def test_a_noise_that_was_stated_is_told_as_such_in_the_budget(name: str, kind: str) -> None:
    found = settings("--budget", "--noise", f"{name}=1e-3").budget
    assert found is not None
    assert {name: origin.words for name, origin in found.origins.items()} == {kind: "stated by --noise"}


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--budget", "--uncertainty", "wind=1"], "--uncertainty: no uncertainty is called 'wind'"),
        (["--budget", "--uncertainty", "force_gain"], "--uncertainty force_gain: write it as NAME=NUMBER"),
        (["--budget", "--uncertainty", "force_gain=-1"], "write a number that is not negative"),
        (["--uncertainty", "force_gain=0.01"], "ask for it with --budget, or leave them out"),
        (["--rig", "lab.toml"], "ask for it with --budget, or leave them out"),
    ],
)
def test_uncertainties_that_cannot_be_are_refused_in_a_line(
    capsys: pytest.CaptureFixture[str], options: list[str], complaint: str
) -> None:
    assert main(["estimate", "somewhere", *options]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert complaint in err
    assert err.count("\n") == 1
