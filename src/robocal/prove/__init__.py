"""Identify, and prove the gain on data that were not used: splits, folds, verdict, region, bands."""
