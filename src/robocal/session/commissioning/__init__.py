"""A virtual rig from power-up to a verified calibration."""
