"""A Dask cluster behind Python's own executor interface, as the workers of one computer are."""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

from estimator.errors import InputError

_PATIENCE_S = 30


@contextmanager
def dask_cluster(address: str) -> Iterator[Executor]:
    """Give the workers of a running Dask scheduler; a case whose worker is lost goes to another one.

    The workers need this project installed, in the same version.

    Parameters
    ----------
    address : such as ``tcp://192.168.0.5:8786``

    Raises
    ------
    InputError
        Dask is not installed, or no scheduler answers there.
    """
    try:
        from distributed import Client  # an optional extra
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
        yield client.get_executor(pure=False)
