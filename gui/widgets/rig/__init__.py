"""What shows the rig while it runs: devices, readings, limits."""
