"""Speed, scaling and accuracy of the estimator on the paper's Pull: ``python -m benchmarks speed|scaling|accuracy``."""
