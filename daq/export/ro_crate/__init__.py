"""A session as an RO-Crate: its files, and who recorded what with which devices, calibrations and software."""
