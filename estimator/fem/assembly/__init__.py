"""The element loops, compiled; the energy of a body, and the assembled tangent."""
