"""Reads a case: fits an elastic block to it, and tells how much each cause's template would add to the fit."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from challenge_baselines.case_folder import Experiment, FloatArray, read_case
from challenge_baselines.elastic_block import Answer, answers_of_block
from challenge_baselines.templates import TEMPLATES, Column, Fitted

RATIOS = (0.35, 0.42, 0.48)
_SMALLEST = 1e-12


@dataclass(frozen=True)
class Reading:
    """What was read off a case.

    Attributes
    ----------
    youngs_modulus, poisson_ratio : of the block that fits best, Pa and 1
    gains : by label, the F statistic of its template beside the block: mean square explained over that left
    misfits : root mean square of what is left, in standard deviations of the noise, of forces, torques and beads
    oddest_bead : share of the beads' misfit that one bead has, and the share that a constant offset of it explains
    facts : of the experiments: beads, anchors, whether it is a block, largest strain, returns
    """

    youngs_modulus: float
    poisson_ratio: float
    gains: Mapping[str, float]
    misfits: tuple[float, float, float]
    oddest_bead: tuple[float, float]
    facts: tuple[float, ...]


def read(folder: Path) -> Reading:
    """Read a case off its folder."""
    experiments = read_case(folder)
    block = answers_of_block(experiments[0], RATIOS)
    reach = max(float(np.linalg.norm(one.motion[:, :3], axis=1).max()) for one in experiments)
    shares = [np.linalg.norm(one.motion[:, :3], axis=1) / reach for one in experiments]
    measured = _stacked(experiments, [(one.wrench, one.beads) for one in experiments])
    known = np.isfinite(measured)
    fixed = [
        (np.zeros_like(one.wrench), np.einsum("mak,nk->nma", block[1].beads, one.motion))
        for one in experiments
    ]
    free = [_block_columns(one, block, share) for one, share in zip(experiments, shares, strict=True)]
    columns = [_stacked(experiments, list(column)) for column in zip(*free, strict=True)]
    base = np.column_stack(columns)[known]
    offset = _stacked(experiments, fixed)[known]
    target = measured[known] - offset
    amounts = np.asarray(np.linalg.lstsq(base, target, rcond=None)[0], dtype=np.float64)
    fitted = np.full(len(measured), 0.0)
    fitted[known] = base @ amounts + offset
    left = target - base @ amounts
    modulus, ratio, stiffness, shape = _material(amounts, block)
    parts = _unstacked(experiments, fitted)
    seen = [
        Fitted(one, wrench, beads, stiffness, shape, share)
        for one, (wrench, beads), share in zip(experiments, parts, shares, strict=True)
    ]
    residual = np.zeros(len(measured))
    residual[known] = left
    channels = _channels(experiments)
    misfits = np.array([_rms(residual[known & (channels == channel)]) for channel in range(3)])
    # what the block does not know of the beads must not hide what the forces say
    weight = 1.0 / np.maximum(misfits, 1.0)[channels][known]
    q = _span(base * weight[:, None])
    gains = {}
    for label, template in TEMPLATES.items():
        own = [_stacked(experiments, list(column)) for column in zip(*map(template, seen), strict=True)]
        gains[label] = _gain(np.column_stack(own)[known] * weight[:, None], q, left * weight)
    force, torque, beads = map(float, misfits)
    return Reading(
        modulus,
        ratio,
        gains,
        (force, torque, beads),
        _oddest_bead(experiments, residual),
        _facts(experiments, reach),
    )


def _block_columns(one: Experiment, block: list[Answer], share: FloatArray) -> list[Column]:
    """Return what is free in the block: E for each ratio, ν, and how either changes with a finite strain."""
    none, still = np.zeros_like(one.wrench), np.zeros_like(one.beads)
    wrenches = [one.motion @ answer.wrench.T for answer in block]
    ways = [np.einsum("mak,nk->nma", answer.beads, one.motion) for answer in block]
    columns = [(1e4 * wrench, still) for wrench in wrenches]
    columns += [(1e4 * wrenches[1] * share[:, None] * np.eye(6)[axis], still) for axis in range(6)]
    columns += [(none, ways[0] - ways[1]), (none, ways[2] - ways[1])]
    columns += [(none, ways[1] * share[:, None, None] * np.eye(3)[axis]) for axis in range(3)]
    columns += [(none, way) for way in _second_order(one)]
    return columns


def _second_order(one: Experiment) -> list[FloatArray]:
    """Return ways of beads that finite strains and turns add: products of motions times quadratic fields."""
    x, y = one.rest[:, 0] / one.size[0], one.rest[:, 1] / one.size[1]
    fields = (np.ones_like(x), x, y, x * y, x**2, y**2)
    along, across = one.motion[:, 0] / one.size[0], one.motion[:, 1] / one.size[0]
    turn = np.linalg.norm(one.motion[:, 3:], axis=1)
    products = (along**2, along * across, across**2, along * turn, turn**2)
    return [
        np.einsum("n,m,a->nma", product, field, np.eye(3)[axis]) * one.size[0]
        for product in products
        for field in fields
        for axis in range(3)
    ]


def _material(amounts: FloatArray, block: list[Answer]) -> tuple[float, float, FloatArray, FloatArray]:
    modulus = max(1e4 * float(amounts[:3].sum()), 1.0)
    soft, hard = float(amounts[9]), float(amounts[10])
    ratio = RATIOS[1] + soft * (RATIOS[0] - RATIOS[1]) + hard * (RATIOS[2] - RATIOS[1])
    return modulus, float(np.clip(ratio, 0.2, 0.499)), modulus * block[1].wrench, block[1].beads


def _gain(own: FloatArray, q: FloatArray, left: FloatArray) -> float:
    """Return the F statistic of further columns: the mean square that they explain over the one that is left."""
    size = np.linalg.norm(own, axis=0)
    beside = own - q @ (q.T @ own)
    kept = beside[:, np.linalg.norm(beside, axis=0) > 1e-6 * size + _SMALLEST]
    if not kept.size:
        return 0.0
    along = _span(kept)
    explained = float(np.sum((along.T @ left) ** 2))
    rest = float(left @ left) - explained
    return (explained / along.shape[1]) / max(
        rest / max(len(left) - q.shape[1] - along.shape[1], 1), _SMALLEST
    )


def _span(columns: FloatArray) -> FloatArray:
    """Return orthonormal columns that span the same, without those that others make up."""
    size = np.linalg.norm(columns, axis=0)
    u, s, _ = np.linalg.svd(columns[:, size > 0] / size[size > 0], full_matrices=False)
    return np.asarray(u[:, s > 1e-6 * s[0]])


def _stacked(experiments: list[Experiment], columns: list[Column]) -> FloatArray:
    """Return observations of all experiments in one vector, in standard deviations of the noise."""
    parts = [
        np.concatenate([(wrench / one.wrench_std).ravel(), (beads / one.beads_std).ravel()])
        for one, (wrench, beads) in zip(experiments, columns, strict=True)
    ]
    return np.concatenate(parts)


def _unstacked(experiments: list[Experiment], values: FloatArray) -> list[Column]:
    found, begin = [], 0
    for one in experiments:
        middle, end = begin + one.wrench.size, begin + one.wrench.size + one.beads.size
        wrench = values[begin:middle].reshape(one.wrench.shape) * one.wrench_std
        found.append((wrench, values[middle:end].reshape(one.beads.shape) * one.beads_std))
        begin = end
    return found


def _channels(experiments: list[Experiment]) -> np.ndarray:
    """Return of each stacked value whether it is a force (0), a torque (1) or a bead's (2)."""
    parts = [
        np.concatenate([np.tile([0, 0, 0, 1, 1, 1], len(one.wrench)), np.full(one.beads.size, 2)])
        for one in experiments
    ]
    return np.concatenate(parts)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _oddest_bead(experiments: list[Experiment], residual: FloatArray) -> tuple[float, float]:
    parts = [
        beads / one.beads_std
        for one, (_, beads) in zip(experiments, _unstacked(experiments, residual), strict=True)
    ]
    together = np.concatenate(parts)
    if not together.size:
        return 0.0, 0.0
    of_bead = np.sum(together**2, axis=(0, 2))
    oddest = int(np.argmax(of_bead))
    constant = sum(len(part) * float(np.sum(part[:, oddest].mean(axis=0) ** 2)) for part in parts)
    return float(of_bead[oddest] / max(of_bead.sum(), _SMALLEST)), constant / max(
        float(of_bead[oddest]), _SMALLEST
    )


def _facts(experiments: list[Experiment], reach: float) -> tuple[float, ...]:
    first = experiments[0]
    turn = max(float(np.linalg.norm(one.motion[:, 3:], axis=1).max()) for one in experiments)
    return (
        float(len(first.rest)),
        float(len(first.anchors)),
        float(first.is_block),
        reach,
        turn,
        float(first.wrench_std[0]),
    )
