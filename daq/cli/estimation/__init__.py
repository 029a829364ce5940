"""Verbs of the mechanics: simulations, estimations, diagnoses, meshes, studies and sealed cases."""
