"""A platform on elastic cables that moves as masses do."""
