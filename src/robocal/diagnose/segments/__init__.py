"""Parts of a file that were measured with something moved."""
