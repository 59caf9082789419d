"""Files that people touch: the only room that knows units and formats, and the only one that writes."""
