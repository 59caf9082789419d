"""Where cables end along a motion: their platform anchors, and the points at which they leave their wheels."""
