"""Cameras and markers."""
