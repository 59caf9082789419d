"""Compiled calls of one pose."""
