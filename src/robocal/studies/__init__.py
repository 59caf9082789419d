"""Simulation studies: many trials of one procedure, as data (docs/studies.md)."""
