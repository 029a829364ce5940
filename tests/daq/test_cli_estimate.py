"""``retract estimate``: what its options ask the fit for, and how wrong ones are answered."""

import argparse

import pytest

from daq.cli import main
from daq.cli.estimation import estimate
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
