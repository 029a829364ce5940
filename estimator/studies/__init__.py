"""Studies: many independent cases, each from a known truth to an estimate, and the tables that they fill."""
