"""From experiments to predictions: which states to solve, on which mesh, and what the sensors would read."""
