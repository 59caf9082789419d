"""Motors and what drives a robot: cogging, friction."""
