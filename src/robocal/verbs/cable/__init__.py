"""Verbs of cable robots: `robocal cable NAME`."""
