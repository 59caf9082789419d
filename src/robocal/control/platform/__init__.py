"""The controller of a platform on cables."""
