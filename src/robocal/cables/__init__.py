"""Cable-driven parallel robots."""
