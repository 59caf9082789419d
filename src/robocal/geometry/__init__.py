"""Rotations, rigid motions and closed-form fits; nothing here knows of robots."""
