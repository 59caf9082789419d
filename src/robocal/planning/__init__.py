"""Which poses to measure, and how many: for arms, and for cable robots."""
