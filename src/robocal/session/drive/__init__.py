"""What the verbs of drives share: a motor found in logs, and what its table explains of others."""
