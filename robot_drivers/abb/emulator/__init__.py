"""An emulated IRC5 controller with an IRB 140, and one that runs the open-abb server."""
