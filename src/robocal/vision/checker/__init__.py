"""Corners of checkerboards, each from all pixels of the four squares around it."""
