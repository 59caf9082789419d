"""What a real rig would record: a true machine, and the instruments around it."""
