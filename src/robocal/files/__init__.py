"""Files that people touch: the only package that knows units and formats, and the only one that writes."""
