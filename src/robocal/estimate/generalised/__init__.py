"""Generalised least squares: local blocks under priors, taken as a correlated error of the rows that touch them."""
