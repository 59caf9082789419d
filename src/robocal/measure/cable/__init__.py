"""Lengths of cables on their shortest way to the normal equations."""
