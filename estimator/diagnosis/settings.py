"""Every number of the diagnosis that is not physics, with its unit, its kind and its reason.

A number is one of four kinds. A *definition* says what a word means (a credible set holds 90 %; evidence is strong
from so many nats on). A *grid* is that of a quadrature over something unknown. A *budget* limits work: with more of it
the answer may get better, and costs more. A *calibrated* number was chosen by what cases with known answers showed;
its origin stands in ``calibration.toml`` beside this module.

Log evidences are in nats. Where a number is a threshold of evidence it is one of a common scale (R. Kass and A.
Raftery, Bayes Factors, J. Am. Stat. Assoc. 90 (1995) 773, their 2 ln B halved): 1 nat is worth a mention, 3 are
strong, 5 very strong; at 10 a rival is as good as beaten by anybody's prior.

>>> from dataclasses import replace
>>> settings = DiagnosisSettings()
>>> settings.search.candidates
7
>>> quick = replace(settings, search=replace(settings.search, candidates=3))
>>> next(number.name for number in quick.numbers() if number.kind == "calibrated")
'noise.outlier_scatter'
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from estimator.diagnosis.declared_numbers import Number, budget, calibrated, check, declared, definition, grid
from estimator.errors import InputError


@dataclass(frozen=True)
class SolverSettings:
    """How exactly a hypothesis is solved."""

    tolerance: float = budget(1e-6, "1", "of the gripping forces; the measurements resolve a thousandth")
    chord_rate: float = budget(0.3, "1", "a tangent serves while each correction leaves less than this")
    tangent_reuse: float = budget(
        0.05, "1", "derivatives a few per cent off lengthen a fit by an iteration at most"
    )
    iterations_beside_neighbour: int = budget(
        12, "1", "beside a known field a state is near or not worth a long search"
    )
    smallest_step: float = budget(1 / 32, "1", "share of the motion from one state to the next")
    smallest_step_of_refit: float = budget(
        1 / 4, "1", "harder ones are shortened in their parameters instead, which costs less"
    )
    strays: int = budget(3, "1", "so many load steps off the neighbour's, and the motion is followed instead")
    poses_apart: int = budget(
        4, "1", "of the motion, every so many are solved where the tissue answers smoothly between"
    )
    smooth_m: float = budget(
        3e-5,
        "m",
        "a state that its neighbours foretell worse is at a kink; between states they miss a sixteenth",
    )
    near: float = budget(0.1, "1", "a change of -ln(1 - 2 nu) that is linear within a hundredth of itself")
    load_waves: int = budget(
        12, "1", "cosines that smooth a measured load: more than ramp, hold, return need"
    )


@dataclass(frozen=True)
class NoiseSettings:
    """What is believed of noise and of meshes before a case is seen."""

    corrected_states: int = budget(3, "1", "states of each experiment that are solved on a finer mesh too")
    best_offset: float = definition(0.05, "1 reading's noise", "better rest positions and zeros do not show")
    worst_offset: float = definition(1.0, "1 reading's noise", "of who does it worse some effects hide in it")
    fewest_beads: int = definition(8, "1", "fewer do not tell rest positions from a smooth misfit")
    least_correlation: float = definition(0.15, "1", "less is not told from a wrong statement of the noise")
    largest_correlation: float = definition(0.9, "1", "rows nearer to equal tell nothing more")
    outlier: float = definition(4.0, "sigma", "of 10 000 readings of mere noise 3 are lost")
    neighbours: int = definition(2, "rows", "before and after a reading, that it is held against")
    outlier_scatter: float = calibrated(
        0.7, "1", "the scatter of a row, known from few beads, counts beyond noise from this share on"
    )
    mesh_share_apart: float = calibrated(
        0.2, "1", "of the mesh's correction left for each channel of a block apart, at the most"
    )
    mesh_share_together: float = calibrated(
        0.3, "1", "of the mesh's correction left for all channels of a kind of a block, at the most"
    )
    mesh_share_beside_rim: float = calibrated(
        0.5, "1", "of the largest correction of a block's bead beside the rim of the grasp, at the most"
    )
    beside_rim: float = calibrated(3.0, "elements", "from the grasp: beads so near feel its singular rim")
    waves_beside_rim: int = budget(4, "1", "shapes along the gripper's way of what meshes leave there")
    edge_shift: float = calibrated(
        0.004, "elements", "times 1 / (1 - 2 nu): by what the finer mesh shifts the edges of the grasp"
    )
    largest_ratio_of_edges: float = calibrated(0.48, "1", "no clean case was nearer to incompressible")
    from_rest: float = definition(0.1, "1", "share of the way from which on a bead may stand aside in full")
    shares_left: tuple[float, ...] = grid((1.0, 0.5, 0.25, 0.1), "1", "of what may be left at the most")
    usual_share_left: float = budget(0.25, "1", "with which the search for the most probable one begins")
    evaluations_of_baseline: int = budget(3, "1", "of the baseline's fit, and of its refit in other noise")
    far_in_ratio: float = budget(0.2, "1", "change of -ln(1 - 2 nu): the mesh's error is measured anew there")
    far_at_rim_m: float = budget(
        1e-4, "m", "change of a rim bead's distance from the grasp: measured anew there"
    )
    nearly_noise: float = definition(
        1.2, "1", "of noise's sum of squares: a cause that leaves less is nearly all"
    )


@dataclass(frozen=True)
class FittingSettings:
    """How far a refit goes."""

    worthwhile: float = budget(0.3, "nat", "a step that lowers the objective by less ends a refit")
    longest_step: float = budget(1.0, "1", "of ln E and -ln(1 - 2 nu)")
    longest_in_scales: float = budget(3.0, "prior deviations", "of an amplitude in a step")
    longest_of_a_range: float = budget(0.06, "1", "of a constant's range in a step")
    shortest: float = budget(0.1, "1", "share of a step below which no shorter one is tried")


@dataclass(frozen=True)
class EvidenceSettings:
    """How the evidence of a hypothesis is computed, and what it is worth."""

    floor_share: float = calibrated(0.002, "1", "of the signal that even the right model may miss")
    smallest_floor: float = definition(0.05, "1 reading's noise", "what is missed below it does not show")
    floors: tuple[float, ...] = grid((1.0, 0.3, 0.03), "1", "shares of that floor, equally likely")
    waves: int = grid(7, "1", "cosines of a smooth misfit along the rows")
    length: float = definition(1 / 3, "of an experiment", "over which a smooth misfit is much the same")
    plane_m: float = definition(0.03, "m", "unit of length of its polynomials over the beads")
    unknown: tuple[float, ...] = grid(
        (0.05, 0.3, 1.0, 3.0, 10.0, 30.0), "1 reading's noise", "amplitudes of an unexplained misfit"
    )
    least_unknown: float = definition(0.1, "1 reading's noise", "an unexplained misfit is larger than this")
    inexact: tuple[float, ...] = grid(
        (0.0, 0.02, 0.05, 0.1), "1", "inexactness of a signature, a share of what it explains"
    )
    sizes: tuple[float, ...] = grid((1.0, 0.3, 0.1, 0.03), "1", "of an effect, shares of its usual one")
    shows: float = definition(2.0, "sigma", "what stands out by so much shows as often as not")
    rows_off: tuple[float, ...] = grid(
        (0.1, 0.16, 0.25, 0.4), "1 bead's noise", "by what single rows may be off; more shows with any"
    )
    noise_as_stated: float = definition(0.05, "1", "the beads show more noise only beyond this share")
    slowest_rows: int = definition(16, "rows", "what is slower is no unsteadiness")
    rough: float = calibrated(8.0, "sigma", "scatter of chi-squared that right causes do not reach")
    rough_tail: float = definition(
        4.0, "sigma", "the same of a baseline, beyond what most residuals show: once in 30 000 cases"
    )
    moved_by_much: float = budget(0.3, "1", "rms in noise beyond which a left-out prediction is solved")
    shortenings: int = budget(3, "1", "of a step to the fit without an experiment")
    stretches: int = definition(10, "1", "of an experiment whose rows are left out in turn")
    prior_of_none: float = definition(0.5, "1", "of no gap")
    prior_of_unknown: float = definition(0.11, "1", "of a cause outside the catalogue")
    prior_of_a_pair: float = definition(0.16, "1", "of a second cause beside one")
    too_small_to_show: float = calibrated(0.05, "1", "share of a label's prior that is too small to show")
    credible: float = definition(0.9, "1", "that a credible set holds")
    tempering: float = calibrated(
        0.02, "1", "share of what the best explanation gains by which evidences may be wrong"
    )
    least_power: float = calibrated(0.15, "1", "to which evidences are tempered at the most")


@dataclass(frozen=True)
class SearchSettings:
    """What is tried, how far, and what is concluded from it."""

    mention: float = definition(
        1.0, "nat", "a difference worth a mention; a refit gains no more on its forecast"
    )
    strong: float = definition(3.0, "nat", "a difference that is strong evidence")
    very_strong: float = definition(5.0, "nat", "what an effect of negligible size must gain to be believed")
    close: float = definition(10.0, "nat", "rivals differ by no more; what is ahead by more surely leads")
    decisive: float = definition(15.0, "nat", "by which two causes stand out from anything unknown")
    candidates: int = budget(7, "1", "that are refitted")
    fewest_candidates: int = budget(3, "1", "that are refitted however little they promise")
    forms_of_a_label: int = budget(3, "1", "among them")
    promising: float = budget(0.35, "1", "of the best's gain: what promises less is not refitted")
    finer: int = budget(4, "1", "finer forms that are refitted at a time")
    alike: float = definition(0.15, "1", "what is mistaken for another explains all but this share of it")
    starts: int = budget(2, "1", "of one effect whose constants are searched")
    shares: int = budget(2, "1", "of the catalogue that are screened apart, each solving the baseline anew")
    condensing: float = budget(20.0, "effects", "cost of condensing the tissue onto the nodes set free")
    hopeless: float = budget(
        12.0, "nat", "below the best trial: not weighed over all floors, which add 2.9 at the most"
    )
    by_floors: float = budget(6.0, "nat", "short of what is asked: not weighed over all floors")
    in_reach: float = budget(0.4, "1", "of the leader's gain that a second point may lack")
    round_points: tuple[int, ...] = budget((2, 5), "1", "points of the rounds of a race")
    round_shares: tuple[float, ...] = budget((0.15, 0.05), "1", "of the leader's gain that each may lack")
    round_forms: tuple[int, ...] = budget((2, 1), "1", "of one label in each round")
    finalists: int = budget(3, "1", "of a round")
    more_to_come: float = budget(2.0, "1", "times what fell last that a further refit may still gain")
    polish: int = budget(3, "1", "points of the winner's last refit")
    same_place: float = definition(0.02, "1", "of a constant's range: two places are one")
    size_of_pairs: float = grid(0.3, "1", "of the usual size, with which all pairs are weighed roughly")
    pairs_in_full: int = budget(60, "1", "that are then weighed over all sizes")
    remainder: float = calibrated(0.05, "1", "of what causes explain that something unknown must explain too")
    partners: int = budget(3, "1", "second causes refitted beside each leader")
    pairs_together: int = budget(2, "1", "pairs refitted that were weighed together")
    starts_of_pairs: int = budget(4, "1", "in all: as many as two workers do in two turns")
    behind: float = budget(0.2, "1", "of what the best pair adds: one that promises so much less is left out")
    another_hollow: float = budget(
        0.2, "1", "of what one cause explains: two that promise so much less are not refitted"
    )
    kept: float = budget(
        2.0, "1", "times what first order promises beside a leader: refitted while that could be all"
    )
    shared: float = calibrated(1000.0, "nat", "that shared errors may leave beside two causes that are there")
    leaders: int = budget(2, "1", "beside which second causes are looked for")
    rivals: int = budget(2, "1", "pairs of labels that are looked at in finer forms")
    more: int = budget(2, "1", "further second causes that are tried beside the best pair's")
    adds_little: float = budget(8.0, "nat", "a pair that adds less is not looked at in other forms")
    passed_over: float = budget(0.5, "1", "of what the best pair adds: what promises it may be that pair")
    near: float = definition(0.25, "1", "sizes and places that differ by less are one")
    in_doubt: float = calibrated(0.2, "1", "nothing is named while none is more probable than this")
    resolving_m: float = budget(6.5e-3, "m", "elements on which a cause that ends within them is refitted")
    resolving_points: int = budget(4, "1", "of that refit")
    resolving_left: float = definition(0.5, "1", "of what it changed that counts as a deviation")


@dataclass(frozen=True)
class ConclusionSettings:
    """What is told, and how sure it is said to be."""

    form_left_open: float = calibrated(0.1, "1", "of what a cause changes E and nu by, for its form's sake")
    within_noise: float = definition(0.01, "1", "of the noise's rms: a gap this small cannot close")
    stretches: int = definition(10, "1", "of an experiment that a bootstrap draws")
    draws: int = budget(400, "1", "of a bootstrap")
    seen: float = definition(3.0, "sigma", "a size of so many deviations is seen")
    mostly_seen: float = definition(3.84, "sigma", "and one of these with eight in ten chances")
    false_alarms: float = definition(0.05, "1", "share of noises alone that may feign a cause")
    causes_to_part: int = budget(3, "1", "leading ones for which a next experiment is chosen")
    apart: float = definition(12.0, "sigma", "causes so far apart need no further experiment")
    manoeuvre_steps: int = budget(4, "1", "out, of a rehearsed manoeuvre")
    manoeuvre_step_s: float = definition(2.0, "s", "between its steps")
    manoeuvre_hold_s: float = definition(30.0, "s", "at its end")
    starts_of_what_if: int = budget(3, "1", "of one label that is asked for")


@dataclass(frozen=True)
class DiagnosisSettings:
    """All numbers of a diagnosis, by the layer that uses them.

    Raises
    ------
    InputError
        A number is not finite or is negative, a grid has no points, or the rounds of a race differ in number.
    """

    solver: SolverSettings = field(default_factory=SolverSettings)
    noise: NoiseSettings = field(default_factory=NoiseSettings)
    fitting: FittingSettings = field(default_factory=FittingSettings)
    evidence: EvidenceSettings = field(default_factory=EvidenceSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    conclusions: ConclusionSettings = field(default_factory=ConclusionSettings)

    def __post_init__(self) -> None:
        for number in self.numbers():
            check(number)
        rounds = {
            len(one) for one in (self.search.round_points, self.search.round_shares, self.search.round_forms)
        }
        if len(rounds) > 1:
            raise InputError(
                "search.round_points, round_shares and round_forms: each round of a race needs all three"
            )

    def numbers(self) -> Iterator[Number]:
        """Yield every number, layer by layer."""
        return declared(self)
