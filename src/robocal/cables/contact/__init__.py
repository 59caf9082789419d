"""Contact along a motion: the compiled search, the platform's body, and the closed form for pure translation."""
