"""What may be wrong with data, tried in one batch: each trial differs in joint values and readings alone."""
