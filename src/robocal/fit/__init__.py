"""One fit: start values, baseline, noise, estimators. Knows no machine and no sensor by name."""
