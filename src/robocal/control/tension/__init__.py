"""Tensions under a controller of cables: those that hold the platform, and what sensors show of them."""
