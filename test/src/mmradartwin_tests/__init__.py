"""Measured-session generator for tests: an indoor radar's raw samples by closed forms, independent of the simulator."""
