"""Verbs of the mechanics: simulations, estimations, studies and sealed cases."""
