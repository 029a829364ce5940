"""CalculiX: the calibrated phantom as an input deck, the solver's run, and what its result file says."""
