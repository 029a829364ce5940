"""A published table of (E, ν) by condition, and which unmodelled effects would have made its estimator report it."""
