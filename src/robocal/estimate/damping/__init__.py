"""Compiled steps of the damped iteration, for a batch of problems in lock step."""
