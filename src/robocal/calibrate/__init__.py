"""Calibration: identify, judge, and keep the evidence."""
