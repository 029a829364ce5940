"""The uncertainty budget of an estimate, in the manner of the GUM (JCGM 100:2008).

Sources of uncertainty (:mod:`~estimator.fit.budget.source`) move the parameters through the estimator's gain, the
derivative of the estimate by what was measured (:mod:`~estimator.fit.budget.gains`). What the fit knows of, such as
noise and tare, is in its covariance already; errors of calibrations and of the geometry
(:mod:`~estimator.fit.budget.systematic`) come on top. :mod:`~estimator.fit.budget.evaluation` puts both together.
"""
