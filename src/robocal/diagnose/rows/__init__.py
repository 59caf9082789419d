"""What is wrong with rows as files have them: outside the limits, copied, repeats that differ, readings that never change."""
