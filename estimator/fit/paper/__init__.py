"""The paper's objective and its optimiser, for comparison with the likelihood."""
