"""Distances between segments, compiled and batched."""
