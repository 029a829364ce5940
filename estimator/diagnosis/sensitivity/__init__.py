"""How a small change of a hypothesis changes what is measured, to first order."""
