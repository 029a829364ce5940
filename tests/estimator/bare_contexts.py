"""Contexts of a comparison in which nothing is solved: what is weighed there is written by hand."""

import typing
from collections.abc import Sequence
from concurrent.futures import Executor

from estimator.diagnosis.evidence.discrepancy import Discrepancy, ModelError
from estimator.diagnosis.fitting.case import Case, Linearisation
from estimator.diagnosis.search.context import Context
from estimator.experiment import Experiment
from estimator.fem.boundary.problem import RetractionProblem
from estimator.inference.whitening import Whitening

NO_ERROR = ModelError((), ((0.1, 0.1),), (0.1, 0.1))


def bare_case(experiments: Sequence[Experiment] = (), whitenings: Sequence[Whitening] = ()) -> Case:
    """A case without a mesh."""
    return Case(experiments, typing.cast(RetractionProblem, None), (), (), whitenings)


def bare_context(
    baseline: Linearisation | None = None, case: Case | None = None, error: ModelError = NO_ERROR
) -> Context:
    """A context in which nobody works."""
    return Context(
        case or bare_case(),
        typing.cast(Linearisation, baseline),
        error,
        typing.cast(Executor, None),
        lambda stage, done, total: None,
    )


def no_error_in(process: Discrepancy) -> ModelError:
    """A model error of one experiment, without a floor."""
    return ModelError((process,), ((0.0, 0.0),), (0.0, 0.0))
