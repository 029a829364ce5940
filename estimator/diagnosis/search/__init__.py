"""The comparison of hypotheses: screening, racing, second causes, the decision."""
