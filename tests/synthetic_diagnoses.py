"""Diagnoses made up for the tests of what is said of them: no mechanics, only plausible numbers."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from estimator.diagnosis.evidence.rivals import Rivals
from estimator.diagnosis.noise.errors_left import ErrorsLeft
from estimator.diagnosis.result import (
    Advice,
    Consideration,
    DeformedMesh,
    Diagnosis,
    EffectFinding,
    Gap,
    Material,
    Outcome,
    Place,
    Quantity,
    Trace,
    Where,
)
from estimator.experiment import Box, Environment, Experiment, Grasp, Phantom, SensorNoise
from estimator.fem.discretisation.block_mesh import structured_mesh

SENSOR = SensorNoise(force_std=0.02, torque_std=5e-4, fiducial_std=5e-5, position_std=3e-5)
DEVIATION = np.array([SENSOR.force_std] * 3 + [SENSOR.torque_std] * 3 + [SENSOR.fiducial_std] * 48)
STEPS_OUT, STEPS_BACK = 8, 4


def small_experiment(name: str = "pull", order: int = 1, seed: int = 1) -> Experiment:
    """A retraction of 12 mm in eight steps with a hold after each, and back in four."""
    rng = np.random.default_rng(seed)
    grid = np.linspace(-0.03, 0.03, 4)
    rest = np.array([[x, y, 0.005] for y in grid for x in grid]) + 5e-4 * rng.normal(size=(16, 3)) * [1, 1, 0]
    out = np.arange(1, STEPS_OUT + 1)
    step = np.repeat(np.arange(STEPS_OUT + STEPS_BACK + 1), [1] + [2] * (STEPS_OUT + STEPS_BACK))
    way = np.concatenate([[0], out, STEPS_OUT - 2 * np.arange(1, STEPS_BACK + 1)])[step] * 1.5e-3
    phase = ("hold",) + ("ramp", "hold") * STEPS_OUT + ("return", "return_hold") * STEPS_BACK
    share = ((rest[:, 0] + 0.05) / 0.09)[None, :, None]
    fiducials = rest + share * np.multiply.outer(way, [1.0, 0.0, 0.15])[:, None, :]
    wrench = np.outer(way / 12e-3, [-3.0, 0.1, 0.2, 0.002, 0.01, 0.03])
    return Experiment(
        name=name,
        phantom_id="P07 <soft>",
        order=order,
        phantom=Phantom("block", (0.1, 0.1, 0.01)),
        anchors=(Box((-0.0501, -0.0501, -0.0051), (-0.0499, 0.0501, 0.0051)),),
        grasp=Grasp(Box((0.03, -0.01, -0.0051), (0.05, 0.01, 0.0051)), (0.04, 0.0, 0.0)),
        trajectory_kind="pull",
        environment=Environment(),
        sensor=SENSOR,
        fiducials_rest=rest,
        time=1.5 * np.arange(len(step)),
        phase=phase,
        step=step,
        position=np.array([0.04, 0.0, 0.0]) + np.outer(way, [1.0, 0.0, 0.0]),
        quaternion_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (len(step), 1)),
        wrench=wrench,
        fiducials=fiducials,
    )


def trace(name: str, order: int, centre: tuple[float, float] | None = None, size: float = 0.0) -> Trace:
    """An experiment whose baseline misses force by ``size`` N, and beads by 1 mm per N around ``centre``."""
    exact = small_experiment(name, order, order)
    rng = np.random.default_rng([order, 7])
    after = np.hstack([exact.wrench, exact.fiducials.reshape(len(exact.time), -1)])
    way = (exact.position[:, 0] - 0.04) / 12e-3
    missed = np.zeros_like(after)
    missed[:, 0] = size * way**2
    if centre is not None:
        apart = exact.fiducials_rest - [*centre, 0.005]
        bump = apart * np.exp(-np.sum(apart**2, axis=1) / 2 / 0.018**2)[:, None]
        missed[:, 6:] = np.multiply.outer(way, 0.12 * size * bump).reshape(len(way), -1)
    measured = after + DEVIATION * rng.normal(size=after.shape)
    recorded = replace(
        exact, wrench=measured[:, :6], fiducials=measured[:, 6:].reshape(exact.fiducials.shape)
    )
    return Trace(recorded, after - missed, after, DEVIATION, stretched_block(exact))


def stretched_block(experiment: Experiment) -> DeformedMesh:
    """A block that its grasp stretches evenly."""
    edges = (np.linspace(-0.05, 0.03, 5), np.linspace(-0.05, 0.05, 6), np.array([-0.005, 0.005]))
    mesh = structured_mesh(edges, "hex27")
    share = (mesh.points[:, 0] + 0.05) / 0.08
    ways = experiment.position - experiment.position[0]
    return DeformedMesh(mesh, np.einsum("n,rx->rnx", share, ways), np.arange(len(ways)))


def finding(label: str, group: str, probability: float = 0.0, **changes: object) -> EffectFinding:
    """An effect that is absent unless ``changes`` tell otherwise."""
    base = EffectFinding(
        label=label,
        form="",
        group=group,
        words=f"what {label} is",
        probability=probability,
        state="absent",
        parameters={"amount": Quantity(0.001, 0.002, "1")},
        chi2_drop=0.4,
        closure_held_out=None,
        detectable={"amount": Quantity(0.006, 0.0, "1")},
    )
    return replace(base, **changes)  # type: ignore[arg-type]  # fields by name, as the tests write them


def outcome(traces: tuple[Trace, ...], closure: float, place: Place | None = None) -> Outcome:
    """A model that closes so much of what the baseline misses."""
    return Outcome(
        parameters={"amount": Quantity(0.3, 0.02, "1")},
        material=Material(Quantity(26_050.0, 180.0, "Pa"), Quantity(0.482, 0.003, "1")),
        gap=Gap(4.31, 4.31 - closure * 3.31, 1.0, closure),
        place=place,
        channels=tuple(one.before + closure * (one.after - one.before) for one in traces),
    )


def diagnosis(
    verdict: tuple[str, ...],
    probabilities: Mapping[str, float],
    effects: tuple[EffectFinding, ...] = (),
    gap: Gap | None = None,
    **changes: object,
) -> Diagnosis:
    """A diagnosis of three experiments."""
    gap = gap or Gap(1.02, 1.01, 1.0, float("nan"))
    base = Diagnosis(
        verdict=verdict,
        probabilities=probabilities,
        credible_set=(max(probabilities, key=lambda label: probabilities[label]),),
        chance=0.0 if verdict else 0.4,
        effects={effect.label: effect for effect in effects},
        gap=gap,
        by_channel={"force": gap, "torque": gap, "fiducials": gap},
        by_experiment={"pull": gap, "twist": gap},
        gap_at_most={
            "force": Quantity(5e-3, 0.0, "N"),
            "torque": Quantity(1.2e-4, 0.0, "N·m"),
            "fiducials": Quantity(7e-6, 0.0, "m"),
        },
        where=Where(
            channels={"fx": 0.4, "fz": 0.3, "x": 0.3},
            steps={"pull/ramp": 0.7, "twist/hold": 0.3},
            blocks={"interior": 0.2, "grasp": 0.3, "anchor": 0.5},
            centre=None,
            centre_std=None,
            radius=None,
        ),
        before=Material(Quantity(24_100.0, 150.0, "Pa"), Quantity(0.431, 0.004, "1")),
        after=Material(Quantity(26_050.0, 180.0, "Pa"), Quantity(0.482, 0.003, "1")),
        cannot_tell=(),
        next_experiment=(),
        outliers=0,
        errors_left=ErrorsLeft(0.1, (0.5,) * 16, 0.25),
        traces=(trace("pull", 1), trace("twist", 2)),
        rivals=Rivals(("gripper_slip", "force_bias"), (1, 2), np.eye(3)),
        considered={},
        seconds=48.2,
    )
    return replace(base, **changes)  # type: ignore[arg-type]  # fields by name, as the tests write them


def no_gap() -> Diagnosis:
    """Nothing stands out of the noise."""
    material = Material(Quantity(26_050.0, 180.0, "Pa"), Quantity(0.482, 0.003, "1"))
    return diagnosis(
        (),
        {"none": 0.962, "unknown": 0.011, "torque_centre": 0.02, "gripper_slip": 0.007},
        (
            finding("torque_centre", "force", 0.02),
            finding("gripper_slip", "grasp", 0.007),
            finding("stress_softening", "material", state="cannot_tell"),
        ),
        before=material,
        after=material,
        cannot_tell=("stress_softening would not show: depth below 0.4 1.",),
    )


def inclusion() -> Diagnosis:
    """A stiff region, found."""
    where = Where(
        channels={
            "fx": 0.31,
            "fy": 0.02,
            "fz": 0.04,
            "tx": 0.0,
            "ty": 0.03,
            "tz": 0.09,
            "x": 0.3,
            "y": 0.2,
            "z": 0.01,
        },
        steps={
            "pull/ramp": 0.3,
            "pull/hold": 0.32,
            "pull/return": 0.1,
            "twist/ramp": 0.2,
            "twist/return_hold": 0.08,
        },
        blocks={
            "interior": 0.94,
            "grasp": 0.03,
            "anchor": 0.02,
            "support": 0.0,
            "force": 0.01,
            "vision": 0.0,
        },
        centre=(-0.0113, 0.0152, 0.0),
        centre_std=(0.0012, 0.0018, 0.001),
        radius=0.0161,
    )
    traces = (trace("pull", 1, (-0.0113, 0.0152), 0.7), trace("twist", 2, (-0.0113, 0.0152), 0.4))
    place = Place((-0.0113, 0.0152, 0.0), 0.0161)
    considered = {
        "inhomogeneity": Consideration(outcome(traces, 0.88, place), outcome(traces, 0.94, place)),
        "modulus_gradient": Consideration(outcome(traces, 0.37), None),
    }
    region = finding(
        "inhomogeneity",
        "inhomogeneity",
        0.93,
        words="a region of the tissue is stiffer or softer than the rest",
        state="present",
        parameters={
            "log_stiffness_ratio": Quantity(0.98, 0.06, "1"),
            "centre_x": Quantity(-0.0113, 0.0012, "m"),
            "centre_y": Quantity(0.0152, 0.0018, "m"),
            "radius": Quantity(0.0161, 0.0009, "m"),
        },
        chi2_drop=2310.0,
        closure_held_out=0.94,
    )
    return diagnosis(
        ("inhomogeneity",),
        {
            "none": 1e-9,
            "unknown": 0.013,
            "inhomogeneity": 0.93,
            "modulus_gradient": 0.052,
            "anchor_debonding": 0.005,
        },
        (
            region,
            finding("modulus_gradient", "inhomogeneity", 0.052, chi2_drop=1200.0, closure_held_out=0.41),
            finding("anchor_debonding", "anchor", 0.005, chi2_drop=420.0, closure_held_out=-0.06),
            finding("stress_softening", "material", state="cannot_tell", detectable={}),
        ),
        Gap(4.31, 1.2, 1.0, 0.94),
        by_channel={
            "force": Gap(3.1, 1.06, 1.0, 0.971),
            "torque": Gap(1.3, 1.33, 1.0, -0.1),
            "fiducials": Gap(5.2, 1.24, 1.0, 0.943),
        },
        by_experiment={"pull": Gap(4.9, 1.2, 1.0, 0.95), "twist": Gap(3.6, 1.21, 1.0, 0.92)},
        where=where,
        cannot_tell=(
            "Whether the tissue softens after a larger strain: no experiment repeats a smaller one.",
        ),
        next_experiment=(
            Advice("Pull along y from the other side", ("inhomogeneity", "modulus_gradient"), 3.4, 9.8),
            Advice("Hold the farthest state for a minute", ("inhomogeneity", "viscoelasticity"), 5.0, 14.0),
        ),
        traces=traces,
        considered=considered,
    )


def unexplained() -> Diagnosis:
    """A gap that nothing in the catalogue explains, and whose candidates make matters worse."""
    return diagnosis(
        ("unknown",),
        {"none": 0.0, "unknown": 0.91, "prestretch": 0.06, "force_drift": 0.03},
        (finding("prestretch", "geometry", 0.06), finding("force_drift", "force", 0.03)),
        Gap(3.0, 3.0, 1.0, 0.0),
        traces=(trace("pull", 1, (0.02, -0.03), 0.5), trace("twist", 2, None, 0.3)),
    )


def two_causes() -> Diagnosis:
    """Relaxation and a yielding anchor together, and something more."""
    relaxation = finding(
        "viscoelasticity",
        "material",
        0.97,
        words="stress relaxes while the gripper holds, and lags on the way back",
        state="present",
        parameters={
            "relaxing_share_1": Quantity(0.28, 0.02, "1"),
            "relaxation_time_1": Quantity(8.1, 1.2, "s"),
        },
        chi2_drop=5200.0,
        closure_held_out=0.71,
    )
    yielding = finding(
        "anchor_compliance",
        "anchor",
        0.93,
        words="the anchored face gives elastically",
        state="present",
        parameters={"compliance": Quantity(8.4e-9, 6e-10, "m/Pa")},
        chi2_drop=810.0,
        closure_held_out=0.22,
    )
    return diagnosis(
        ("viscoelasticity", "anchor_compliance", "unknown"),
        {
            "none": 0.0,
            "unknown": 0.004,
            "viscoelasticity": 0.97,
            "permanent_set": 0.02,
            "anchor_compliance": 0.006,
        },
        (relaxation, yielding, finding("permanent_set", "material", 0.02)),
        Gap(6.2, 1.5, 1.0, 0.9),
        traces=(trace("pull", 1, None, 0.9), trace("twist", 2, None, 0.8)),
    )
