"""Compiled equilibrium of a platform on its cables."""
