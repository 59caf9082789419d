"""The measurement kinds that exist: one import line each."""

from robocal.measure import distance, lengths, pixels, pose, position

__all__ = ["distance", "lengths", "pixels", "pose", "position"]
