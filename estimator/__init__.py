"""Mechanics and statistics: mesh, materials, forward model, sensitivities, fit. Knows no device and no window."""
