"""What an ATI transducer is, whatever reads it: its calibration, gages, units and status words."""
