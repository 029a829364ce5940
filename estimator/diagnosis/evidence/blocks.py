"""In which block of the rig something unknown lies: what anything of that block could do, labelled or not.

A laboratory acts on a block. What no label fits may still be one of the cameras' doings, all of which leave the forces
as they are, or of the anchors'. To first order a block can do all that its effects do, at once and of any size: a
linear model of their signatures with Gaussian priors (MacKay, Neural Comput. 4 (1992) 415). The sensors' blocks can
moreover do anything smooth to their own channels, and nothing to others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import softmax

from estimator.diagnosis.evidence.discrepancy import ModelError, Moments
from estimator.diagnosis.evidence.floors import over_floors, unknown_evidence
from estimator.diagnosis.evidence.marginal_likelihood import priors_of
from estimator.diagnosis.evidence.signatures import Signature
from estimator.diagnosis.model.free_parameters import HypothesisParameter
from estimator.diagnosis.settings import EvidenceSettings
from estimator.effects.blocks import BLOCK_OF_GROUP
from estimator.inference.laplace import Priors

# By block, whether it can do anything to the wrench, and to the fiducials, with nothing done to the tissue.
_OWN_CHANNELS: Mapping[str, tuple[bool, bool]] = {
    "force": (True, False),
    "timing": (True, False),
    "vision": (False, True),
}


def evidence_of_blocks(
    moments: Moments,
    free: Sequence[HypothesisParameter],
    signatures: Sequence[Signature],
    error: ModelError,
) -> dict[str, float]:
    """Return the log evidence of something unknown in each block, none for a block without effects.

    Parameters
    ----------
    moments : of the baseline's residual, its derivatives, and the signatures, in this order
    free : parameters of the baseline, E and ν
    signatures : of every effect at every start
    error : what any model misses
    """
    own = list(range(1 + len(free)))
    columns: dict[str, list[int]] = {}
    amplitudes: dict[str, list[HypothesisParameter]] = {}
    at = len(own)
    for signature in signatures:
        block, count = BLOCK_OF_GROUP[signature.effect.group], len(signature.free_parameters)
        columns.setdefault(block, []).extend(range(at, at + count))
        amplitudes.setdefault(block, []).extend(signature.free_parameters)
        at += count
    found = {}
    for block, chosen in columns.items():
        everything = _of_any_sign(free, amplitudes[block], error.settings)
        values = [over_floors(moments.among([*own, *chosen]), everything, error)]
        if block in _OWN_CHANNELS:
            alone = moments.among(own), priors_of(free, error.settings)
            values.append(unknown_evidence(*alone, error, *_OWN_CHANNELS[block]))
        found[block] = max(values)
    return found


def shares_of_unknown(evidence: Mapping[str, float], power: float) -> dict[str, float]:
    """Return the probability of each block, were there something unknown: each as likely beforehand.

    Parameters
    ----------
    evidence : log evidence of something unknown in each block
    power : to which evidences are raised
    """
    shares = softmax(power * np.array(list(evidence.values())))
    return dict(zip(evidence, map(float, shares), strict=True))


def _of_any_sign(
    free: Sequence[HypothesisParameter], amplitudes: Sequence[HypothesisParameter], settings: EvidenceSettings
) -> Priors:
    """Return the priors of amplitudes that are large or small together, none of them bounded."""
    together = [replace(one, effect=0, lower=-np.inf, upper=np.inf) for one in amplitudes]
    return priors_of((*free, *together), settings)
