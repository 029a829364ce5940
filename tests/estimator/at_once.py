"""Diagnoses in one process, on coarse meshes."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from typing import Any

import pytest

from estimator.diagnosis import diagnose as diagnosing
from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.noise import refinement
from estimator.diagnosis.result import Diagnosis
from estimator.effects.catalogue import Catalogue
from estimator.errors import EstimatorError
from estimator.experiment import Experiment
from estimator.fem.discretisation.block_mesh import Grading


class AtOnce(Executor):
    """Works in this process, so that a warning is an error here as everywhere."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except EstimatorError as error:
            future.set_exception(error)
        return future


@contextmanager
def at_once() -> Iterator[Executor]:
    yield AtOnce()


def diagnosed_at_once(
    experiments: list[Experiment], catalogue: Catalogue, coarse: Grading, fine: Grading
) -> Diagnosis:
    """The diagnosis among a catalogue's causes; its discretisation error is what two gradings differ by."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(diagnosing, "worker_pool", at_once)
        patch.setattr(refinement, "GRADING", coarse)
        patch.setattr(refinement, "FINE_GRADING", fine)
        return diagnose(experiments, catalogue=catalogue)
