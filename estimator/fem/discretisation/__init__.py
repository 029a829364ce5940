"""Meshes and their elements: shapes, quadrature, surfaces, and what share each node has."""
