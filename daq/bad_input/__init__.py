"""Broken forms of everything that a user hands over: ``python -m daq.bad_input --help``."""
