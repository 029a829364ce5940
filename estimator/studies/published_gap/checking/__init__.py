"""The learnt map held against simulations that it was not learnt from."""
