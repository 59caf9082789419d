"""What the verbs of cable robots do. One file per verb, with a function of its name."""
