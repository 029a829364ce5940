"""Verbs of the mechanics: simulations, estimations, diagnoses, studies and sealed cases."""
