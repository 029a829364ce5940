"""What every inference shares, whatever its model: of the fit, the online estimate and the diagnosis."""
