"""The candidate causes of a published gap: effects of the catalogue over a range of sizes, and factors on the bench.

What acts on the retraction is an effect of :mod:`estimator.effects`; its size is its first amplitude, with the prior of
its catalogue entry: a normal distribution with the usual size as deviation, its positive half where the effect has a
sign. A size with a stiffness of its own is simulated at the reference modulus: a compliance C m/N does to tissue of
modulus E what C E / E₀ does at E₀, a weight or a force the inverse.
"""

from estimator.studies.published_gap.candidate import Candidate, Size

_SIGNED_MM = (-8e-3, -4e-3, -2e-3, 2e-3, 4e-3)
# Log E of the bench test off that of the tissue at small strain: a third either way is one deviation.
_BENCH = 0.3


CANDIDATES: tuple[Candidate, ...] = (
    Candidate(
        "tissue slides in the gripper beyond a force",
        "gripper_slip:gradual",
        (
            Size(
                "slip_per_force",
                "m/N at 5 kPa",
                (4e-3, 9e-3, 1.2e-2, 1.5e-2),
                8e-3,
                1,
                at_reference_alone=True,
            ),
            Size("threshold", "N", (0.02, 0.06, 0.12, 0.25, 0.5), 0.0, -1, between=(0.03, 3.0)),
        ),
        direct_check="mark the tissue at the jaws and measure the mark's way against the gripper's",
        checks=((6e-3, 0.04), (1.05e-2, 0.09), (1.2e-2, 0.17)),
    ),
    Candidate(
        "gripper or arm gives way elastically",
        "gripper_compliance:translation",
        (Size("compliance", "m/N", (1e-3, 3e-3, 8e-3, 1.6e-2), 5e-4, grows_with=1),),
        direct_check="hang a known weight on the closed jaws and measure by how much they sink",
        checks=(
            (2e-3,),
            (5e-3,),
        ),
    ),
    Candidate(
        "the jaws hold the tissue nearer to the anchor (−) or farther from it (+) than stated",
        "grasp_misplacement:jaws",
        (Size("shift_x", "m", _SIGNED_MM, 3e-3, one_sided=False),),
        direct_check="measure from the anchored face to the edge of the jaws",
        checks=(
            (-3e-3,),
            (3e-3,),
        ),
        constants={"shift_y": 0.0},
        called="grasp_along",
    ),
    Candidate(
        "the gripper stood nearer to the anchor (−) or farther from it (+) than registered",
        "grasp_misplacement:gripper",
        (Size("shift_x", "m", _SIGNED_MM, 3e-3, one_sided=False),),
        direct_check="measure from the anchored face to the edge of the jaws",
        checks=(
            (-3e-3,),
            (3e-3,),
        ),
        constants={"shift_y": 0.0},
        called="gripper_along",
    ),
    Candidate(
        "the anchored face gives way elastically",
        "anchor_compliance:isotropic",
        (Size("length", "m of tissue", (1e-3, 4e-3, 9e-3, 18e-3), 4e-3),),
        direct_check="put beads on the anchored face and see whether they move",
        checks=(
            (2e-3,),
            (6e-3,),
        ),
    ),
    *(
        Candidate(
            f"part of the anchored face has come off, {words}",
            "anchor_debonding:throughout",
            (Size("share", "of the area", nodes, 0.2),),
            direct_check="look along the anchored face under load",
            checks=tuple((x,) for x in checks),
            constants={"place": place},
            called=f"debonding_{where}",
        )
        for where, words, place, nodes, checks in (
            (
                "end",
                "from the far end of its rim",
                1.0,
                (0.03, 0.06, 0.1, 0.14, 0.17, 0.2, 0.23, 0.26),
                (0.08, 0.185, 0.215),
            ),
            ("middle", "in its middle", 0.5, (0.1, 0.2, 0.25, 0.3, 0.36, 0.42, 0.5), (0.17, 0.39)),
        )
    ),
    Candidate(
        "the phantom rubs on the table",
        "support_friction:laid_down_anew",
        (Size("coefficient", "1", (0.1, 0.3, 0.8, 1.6), 0.5, grows_with=-1),),
        direct_check="retract once more on a wetted or powdered table",
        checks=(
            (0.2,),
            (0.5,),
        ),
        constants={"contact": 0.0, "adhesion": 40.0},
    ),
    Candidate(
        "the phantom was mounted under tension that the sensor's zero hides",
        "prestretch:along",
        (Size("along", "m", (1e-3, 2.5e-3, 5e-3), 1.5e-3),),
        direct_check="zero the sensor before the jaws close",
        checks=((1.7e-3,),),
    ),
    Candidate(
        "the phantom is thicker (+) or thinner (−) than stated",
        "thickness_error:about_middle",
        (Size("excess", "1", (-0.4, -0.2, -0.1, 0.1, 0.2), 0.08, one_sided=False),),
        direct_check="measure its thickness with a calliper",
        checks=(
            (-0.15,),
            (0.15,),
        ),
        called="thickness",
    ),
    Candidate(
        "the cameras see motion too large (+) or too small (−)",
        "camera_scale:uniform",
        (Size("scale_error", "1", (-0.06, -0.03, 0.03, 0.06), 0.015, one_sided=False),),
        direct_check="compare the spacing of the beads at rest with the mould's",
        checks=(
            (-0.015,),
            (0.045,),
        ),
    ),
    Candidate(
        "the silicone stiffens with strain",
        "strain_stiffening:yeoh2",
        (Size("c2", "1", (0.3, 0.8, 1.6), 0.47),),
        direct_check="fit E by the length of the pull, and a law to the bench test's record",
        checks=(
            (0.5,),
            (1.2,),
        ),
        called="stiffening",
    ),
    Candidate(
        "stress relaxes between steps, and the bench test was faster",
        "viscoelasticity:one_term",
        (Size("relaxing_share_1", "of the stress that stays", (0.15, 0.4, 0.8), 0.4),),
        direct_check="hold the last step for a minute and look at the force",
        checks=(
            (0.25,),
            (0.6,),
        ),
        constants={"relaxation_time_1": 8.0},
        on_bench="relaxed",
        called="relaxation",
    ),
    Candidate(
        "the phantoms had been stretched before, the bench test's specimens not",
        "stress_softening:pseudo_elastic",
        (Size("depth", "of the stress", (0.15, 0.35, 0.6), 0.2),),
        direct_check="test a fresh specimen twice in a row on the bench",
        checks=(
            (0.25,),
            (0.45,),
        ),
        constants={"width_over_modulus": 0.002, "relative_width": 0.0},
        conditioned=True,
        called="mullins",
    ),
    # Lying phantoms hang by what the table does not carry. More than the last of these, a millimetre's sag, does not
    # solve from the flat sheet, and that only where the tissue is less near to incompressible.
    Candidate(
        "the table does not carry all of the phantom's weight, and it sags",
        "gravity_sag:beads_hanging",
        (Size("weight", "of its own", (0.01, 0.02, 0.03), 0.05, grows_with=-1),),
        direct_check="measure the height of the beads at rest against that of the anchor",
        checks=((0.015,),),
        poisson_ratio=0.40,
    ),
    Candidate(
        "the bench modulus was read at another strain, or scaled by another common factor",
        sizes=(
            Size("log_factor", "ln E of the tissue over the bench's", (-1.5, 1.5), _BENCH, one_sided=False),
        ),
        on_bench="common",
        direct_check="fit the bench test's record over the strains of the retraction",
        called="bench_strain",
    ),
    Candidate(
        "the bench test is off by another factor for each mixture",
        sizes=(Size("deviation", "of ln E between mixtures", (1e-3, 1.5), _BENCH),),
        on_bench="each",
        direct_check="test specimens cut from the phantoms themselves",
        called="bench_error",
    ),
)
