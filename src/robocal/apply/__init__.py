"""What is done with a calibrated model: targets compensated, poses validated, drift found, accuracy mapped."""
