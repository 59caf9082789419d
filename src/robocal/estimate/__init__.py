"""Estimation on vectors: problems, solvers, identifiability, uncertainty; nothing here knows of robots."""
