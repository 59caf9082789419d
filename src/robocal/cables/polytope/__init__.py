"""Compiled nearest point of a polytope."""
