"""One inference for every model: free parameters, linearisation, whitening, Gauss-Newton, mesh correction, evidence.

The fit, the online estimate and the diagnosis bring their own model and their own free parameters; what is done with
these is done here. A model linearised at a point is a :class:`~estimator.inference.linear_model.LinearModel`.
"""
