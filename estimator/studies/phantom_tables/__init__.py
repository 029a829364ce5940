"""Tables VI to VIII: a laboratory's own phantoms, beside the bench test of their silicones."""
