"""A live view for programs of the Foxglove protocol: they see what a client of the acquisition is told, and no more."""
