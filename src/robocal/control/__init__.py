"""Controllers as pure, compiled step functions."""
