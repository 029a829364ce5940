"""The front door: what a script or a notebook imports from ``estimator``, and results that show themselves."""
