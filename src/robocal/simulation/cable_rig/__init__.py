"""A cable robot with drives, camera and instruments, as a builder finds it before any calibration."""
