"""What the page and the terminal say of what the measurements tell and what they do not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from test_report_estimation import estimate_of, pull_fit, words, written

from estimator.fit.identifiability import Absorption, identifiability
from estimator.fit.profile import Profile
from estimator.fit.result import Estimate, Floated, ParameterEstimate
from estimator.inference.material_parameters import POISSON_RATIO, YOUNGS_MODULUS, law_parameters
from estimator.materials import law_named
from estimator.report.estimation.findings import summary_text

GAIN = Absorption("force gain", "1 %", 1.0, 0.0, {"youngs_modulus": 0.01, "poisson_ratio": 1e-14})
TRAVEL = Absorption("gripper travel", "1 %", 0.2, 9.0, {"youngs_modulus": 0.002, "poisson_ratio": -0.003})
BOTH = (YOUNGS_MODULUS, POISSON_RATIO)
NO_PRIOR = np.zeros((2, 2))


def examined() -> Estimate:
    floated = Floated(
        tares=(np.array([0.012, 0.0, 0.0, 0.0, 3e-4, 0.0]),),
        rest_offsets=np.full((3, 3), 2e-5),
        force_gain=0.0,
        discretisation={"youngs_modulus": -21.0, "poisson_ratio": 0.002},
        least_weight=0.01,
        rejected_share=0.03,
    )
    points = ((0.446, 5.1), (0.4512, 0.0), (0.456, 4.2))
    return replace(
        estimate_of(pull_fit()),
        identifiability=identifiability(BOTH, np.diag([1e4, 1e4]), NO_PRIOR, [GAIN, TRAVEL]),
        absorptions=(GAIN, TRAVEL),
        floated=floated,
        profiles=(Profile("poisson_ratio", points, (0.447, 0.455)),),
    )


def test_the_terminal_says_what_cannot_be_told_apart_and_what_was_taken_up() -> None:
    text = summary_text(examined(), None)
    gain = "Force gain and E cannot be told apart: 1 % too much of it moves E by +1 % and leaves no trace"
    assert f"{gain} in the residuals." in text
    assert "Gripper travel" not in text
    taken = text[text.index("Taken up besides:") :]
    for part in (
        "tares up to 0.012 N and 0.3 mN·m",
        "rest positions of the fiducials off by 20 µm (rms)",
        "3 % of the measurements, which the loss gave little weight",
        "the discretisation error, which moved E by -21 Pa and ν by +0.002",
    ):
        assert part in taken


def test_the_page_has_a_section_of_it_with_the_profiles(tmp_path: Path) -> None:
    page = written(examined(), tmp_path)
    text = words(page)
    assert "What the measurements tell" in text
    assert "gripper travel 1 % too large20.0 %9 σ" in text
    assert "Profile likelihood: rise of χ²" in text
    assert "rise of χ²" in page


def test_an_estimate_that_nobody_examined_has_no_such_section(tmp_path: Path) -> None:
    assert "What the measurements tell" not in words(written(estimate_of(pull_fit()), tmp_path))


def test_a_parameter_that_was_given_is_told_as_such() -> None:
    given = ParameterEstimate(0.49, 0.0, (0.49, 0.49))
    text = summary_text(replace(estimate_of(pull_fit()), poisson_ratio=given), None)
    assert text.splitlines()[1] == "ν = 0.49 (given)"


def test_parameters_that_make_up_for_each_other_are_named_by_degree() -> None:
    for correlation, words_for_it in ((0.99, "are hard to tell apart"), (1 - 1e-6, "cannot be told apart")):
        information = 1e8 * np.array([[1.0, correlation], [correlation, 1.0]])
        (sentence,) = identifiability(BOTH, information, NO_PRIOR, [])
        assert sentence.startswith(f"E and ν {words_for_it}")


def test_a_parameter_that_the_data_leave_open_is_named() -> None:
    parameters = law_parameters(law_named("yeoh2"))
    found = identifiability(parameters, np.diag([1e4, 1e4, 0.01]), np.zeros((3, 3)), [])
    assert found == ("The measurements hardly determine c2: its interval is as wide as what it could be.",)


def test_well_determined_parameters_leave_nothing_to_say() -> None:
    assert identifiability(BOTH, np.diag([1e4, 1e4]), NO_PRIOR, [TRAVEL]) == ()
