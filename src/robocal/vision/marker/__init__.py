"""Corners of a printed marker, from one fit of all its pixels."""
