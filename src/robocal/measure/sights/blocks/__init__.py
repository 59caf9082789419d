"""Blocks of rows whose errors are correlated, in compiled code."""
