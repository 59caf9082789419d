"""Which columns of a problem are kept."""
