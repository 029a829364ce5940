"""Verbs about bodies: their meshes, and phantoms from segmented images."""
