"""What the effects of the catalogue would do to the measurements, and how alike that is: what tests among them use."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# A direction of whose squared length less than this share is left is none.
_UNSEEN = 1e-9


@dataclass(frozen=True, eq=False)
class Rivals:
    """Signatures of effects, with what is free without any of them projected out.

    Attributes
    ----------
    labels, sizes : of each rival, its label and how many amplitudes it has
    inner : (k, k) inner products of all signatures, each of unit length before the projection, in white noise
    """

    labels: tuple[str, ...]
    sizes: tuple[int, ...]
    inner: FloatArray

    def slices(self) -> Iterator[slice]:
        """Yield the columns of each rival."""
        at = 0
        for size in self.sizes:
            yield slice(at, at + size)
            at += size

    def directions(self, own: slice) -> FloatArray:
        """Return (size, q) combinations of a rival's amplitudes that are seen, each of one sigma and apart."""
        values, vectors = np.linalg.eigh(self.inner[own, own])
        seen = values > _UNSEEN
        return np.asarray(vectors[:, seen] / np.sqrt(values[seen]))

    def noise(self, draws: int, seed: int) -> FloatArray:
        """Draw the inner products (k, draws) of white noise with the signatures."""
        eigenvalues, eigenvectors = np.linalg.eigh(self.inner)
        root = eigenvectors * np.sqrt(np.maximum(eigenvalues, 0.0))
        return np.asarray(root @ np.random.default_rng(seed).standard_normal((len(root), draws)))


def projected(
    gram: FloatArray, nuisances: int, labels: Sequence[str], sizes: Sequence[int]
) -> tuple[Rivals, FloatArray]:
    """Project what is free without any effect out of inner products.

    Parameters
    ----------
    gram : (1 + p + k)² of the misfit in units of white noise, of the derivatives by what is free without any effect,
        and of those by the amplitudes of all effects
    nuisances : p
    labels, sizes : of each effect, its label and how many amplitudes it has

    Returns
    -------
    rivals : Rivals
    seen : (k,) inner products of the misfit with them
    """
    length = np.sqrt(np.maximum(np.diag(gram)[1:], np.finfo(float).tiny))
    cosine, seen = gram[1:, 1:] / np.outer(length, length), gram[1:, 0] / length
    known = slice(0, nuisances)
    passed = np.linalg.pinv(cosine[known, known], hermitian=True) @ cosine[known]
    left, seen = cosine - cosine[:, known] @ passed, seen - passed.T @ seen[known]
    return Rivals(tuple(labels), tuple(sizes), left[nuisances:, nuisances:]), seen[nuisances:]
