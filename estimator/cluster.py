"""A Dask cluster behind Python's own executor interface, as the workers of one computer are."""

from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager

from estimator.errors import InputError, WorkersLostError

_PATIENCE_S = 30


@contextmanager
def dask_cluster(address: str) -> Iterator[Executor]:
    """Give the workers of a running Dask scheduler; a case whose worker is lost goes to another one.

    The workers need this project installed, in the same version. They need not share a folder with this computer: what
    is made there comes back, and is written here.

    Parameters
    ----------
    address : such as ``tcp://192.168.0.5:8786``

    Raises
    ------
    InputError
        Dask is not installed, or no scheduler answers there.
    WorkersLostError
        The scheduler is gone, or a case has ended several workers.
    """
    try:
        from distributed import Client, KilledWorker  # an optional extra
    except ImportError:
        raise InputError(
            "a Dask scheduler needs the package distributed; install it with: pip install 'retraction[cluster]'"
        ) from None
    try:
        client = Client(address, timeout=_PATIENCE_S)
    except (OSError, ValueError) as error:
        raise InputError(
            f"{address}: no Dask scheduler answers there ({error}); start one with: dask scheduler"
        ) from error
    with client:
        try:
            yield client.get_executor(pure=False)
        except KilledWorker as error:
            raise WorkersLostError(
                f"{address}: one case has ended several workers, the last {error.last_worker}"
            ) from error
        except CancelledError as error:
            raise WorkersLostError(f"{address}: the Dask scheduler is gone") from error
