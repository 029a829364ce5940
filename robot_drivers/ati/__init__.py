"""ATI force/torque sensors, a Gamma among them: Net F/T and NETCANOEM, drivers and emulators."""
