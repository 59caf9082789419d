"""The cases of the demo: stories made of other verbs."""
