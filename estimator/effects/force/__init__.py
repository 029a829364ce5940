"""From the tissue's wrench to the recorded one: what pulls at the sensor, its mounting, its bridges, its clock."""
