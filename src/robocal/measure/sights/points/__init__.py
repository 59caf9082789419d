"""Points of one frame before a camera, a tile of them at a time."""
