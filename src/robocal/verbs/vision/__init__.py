"""Verbs of cameras and printed sheets: `robocal vision NAME`."""
