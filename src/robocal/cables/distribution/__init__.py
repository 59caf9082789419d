"""Compiled tension distributions."""
