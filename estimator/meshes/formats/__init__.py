"""Readers and writers of volume meshes, one for each format."""
