"""Every figure that the paper gives, in SI units; what it leaves open is said where it is used.

"Estimation of Soft Tissue Mechanical Parameters From Robotic Manipulation Data", sections IV to VI. A figure with a
relative deviation is the mean of twenty draws.
"""

from estimator.studies.tables.figure import Figure


def _drawn(
    modulus: tuple[float, float],
    ratio: tuple[float, float],
    seconds: tuple[float, float],
    fiducials: tuple[float, float],
    force: tuple[float, float],
) -> Figure:
    names = ("youngs_modulus", "poisson_ratio", "seconds", "rmse_fiducials", "rmse_force")
    spread = zip(names, (modulus, ratio, seconds, fiducials, force), strict=True)
    return Figure(
        modulus[0],
        ratio[0],
        seconds[0],
        None,
        None,
        fiducials[0],
        force[0],
        {name: pair[1] for name, pair in spread},
    )


TABLE_I = {
    "case 1": Figure(15.18e3, 0.4897, 2452, 9, 30, 4.32e-6, 6.73e-5),
    # The table reads 773 (450 + 90), whose parts do not add up.
    "case 2": Figure(14.98e3, 0.4849, 773, 15, 46, 8.30e-5, 2.37e-3),
}
# By the height scale of the relief as a share of the tissue's thickness.
TABLE_II = {
    0.02: Figure(17.00e3, 0.4693, 375, 11, 34, 1.15e-4, 1.69e-3),
    0.04: Figure(19.40e3, 0.4654, 897, 14, 42, 1.25e-4, 1.85e-3),
    0.08: Figure(23.97e3, 0.4607, 956, 4, 12, 1.36e-4, 2.17e-3),
}
# By the standard deviation of the centre of the grasp, m.
TABLE_III = {
    5e-3: _drawn((13.82e3, 0.12), (0.4677, 0.04), (966, 0.27), (6.22e-4, 0.65), (4.22e-2, 0.63)),
    10e-3: _drawn((12.06e3, 0.27), (0.4574, 0.09), (1445, 0.79), (1.71e-3, 0.79), (1.48e-1, 0.63)),
    20e-3: _drawn((13.33e3, 0.62), (0.3960, 0.28), (1023, 0.60), (2.94e-3, 0.76), (1.63e-1, 1.07)),
}
# By the share in the table; its text says 10, 20 and 50 %.
TABLE_IV = {
    0.10: _drawn((14.65e3, 0.02), (0.4852, 0.02), (1174, 0.23), (4.14e-4, 0.30), (3.05e-2, 0.44)),
    0.25: _drawn((13.88e3, 0.08), (0.4733, 0.06), (1510, 0.36), (1.01e-3, 0.29), (7.66e-2, 0.34)),
    0.50: _drawn((13.41e3, 0.19), (0.4508, 0.13), (1190, 0.45), (2.42e-3, 0.37), (1.83e-1, 0.66)),
}
TABLE_V = {
    "gradual_tangent_pull": Figure(15.09e3, 0.4720, 3057, 8, 29, 2.17e-4, 2.06e-2),
    "twist_and_pull": Figure(15.06e3, 0.4762, 1604, 17, 51, 1.68e-4, 9.99e-3),
}
LIVER_TRUTH = (15e3, 0.35)
# Its mean error of the fiducials and its largest force error are bounds, not root mean squares.
LIVER = Figure(13.36e3, 0.30)
LIVER_FIDUCIALS_M, LIVER_FORCE_N = 0.9e-3, 1.5

# Of the silicones by their parts A : B : thinner; mean and deviation of the bench test, Pa.
BENCH = {"1:1:0": (36.21e3, 2.62e3), "1:1:1": (10.91e3, 1.54e3), "1:1:2": (5.29e3, 1.92e3)}
HOLLENSTEIN_PA = 29.5e3

# One side anchored and two adjacent ones, by motion and silicone.
TABLE_VI = {
    ("pull", "1:1:0"): Figure(26450, 0.304, 892, 11, 36),
    ("pull", "1:1:1"): Figure(10090, 0.3134, 418, 9, 27),
    ("pull", "1:1:2"): Figure(3860, 0.1683, 570, 4, 21),
    ("gradual_tangent_pull", "1:1:0"): Figure(26360, 0.2787, 1230, 9, 27),
    ("gradual_tangent_pull", "1:1:1"): Figure(10310, 0.3394, 683, 9, 28),
    ("gradual_tangent_pull", "1:1:2"): Figure(4000, 0.3725, 1174, 9, 33),
    ("twist_and_pull", "1:1:0"): Figure(27060, 0.3465, 804, 4, 12),
    ("twist_and_pull", "1:1:1"): Figure(10570, 0.3504, 348, 8, 24),
    ("twist_and_pull", "1:1:2"): Figure(3870, 0.18112, 2441, 14, 179),
}
TABLE_VII = {
    ("pull", "1:1:0"): Figure(25230, 0.3984, 728, 10, 35),
    ("pull", "1:1:1"): Figure(8620, 0.3324, 1100, 9, 27),
    ("pull", "1:1:2"): Figure(4070, 0.3984, 421, 10, 45),
    ("gradual_tangent_pull", "1:1:0"): Figure(25250, 0.3416, 1514, 20, 76),
    ("gradual_tangent_pull", "1:1:1"): Figure(7770, 0.3026, 1804, 8, 24),
    ("gradual_tangent_pull", "1:1:2"): Figure(4130, 0.3793, 988, 9, 30),
    ("twist_and_pull", "1:1:0"): Figure(24960, 0.4157, 969, 9, 29),
    ("twist_and_pull", "1:1:1"): Figure(8660, 0.2602, 1840, 25, 202),
    ("twist_and_pull", "1:1:2"): Figure(4480, 0.1608, 654, 9, 74),
}
