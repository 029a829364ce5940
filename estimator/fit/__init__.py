"""From measurements to parameters with their uncertainty.

    from estimator.experiment import read_experiment
    from estimator.fit.estimate import estimate
    from estimator.fit.losses import loss_named
    from estimator.fit.settings import FitSettings
    from estimator.inference.free_parameter import NormalPrior
    from estimator.materials import law_named

    found = estimate([read_experiment(folder)])          # E and ν, maximum likelihood
    settings = FitSettings(
        law=law_named("yeoh2"),                          # any law of estimator.materials
        fixed={"poisson_ratio": 0.49},                   # everything else of the law is free
        priors={"youngs_modulus": NormalPrior(15e3, 2e3)},     # mean and deviation, in the parameter's unit
        bounds={"c2": (0.0, 1.0)},
        loss=loss_named("huber"),                        # or "linear", "cauchy"
        intervals="profile",                             # or "linear"
    )
    found = estimate([experiment], progress, settings)
    found.parameters["c2"].interval95

``FitSettings(objective="paper")`` minimises the paper's objective by sequential quadratic programming instead, and
``nuisances`` names what floats besides the material. :class:`~estimator.fit.result.Estimate` holds what was found.
"""
