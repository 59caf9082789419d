"""Robot and data opened as one and checked; a run folder written and opened again. Nothing here writes to a terminal."""
