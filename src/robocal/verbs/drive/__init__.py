"""Verbs of motors: `robocal drive NAME`."""
