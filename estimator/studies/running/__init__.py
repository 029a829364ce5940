"""Carries out the cases of a study: here or on a cluster, each kept as soon as it is known."""
