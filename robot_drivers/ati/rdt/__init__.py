"""A force/torque sensor that streams RDT over UDP and tells on its web pages what it is set to."""
