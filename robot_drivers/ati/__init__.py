"""ATI force/torque sensors, a Gamma among them: drivers and emulators for network, CAN and serial lines."""
