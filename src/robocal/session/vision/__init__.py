"""What verbs of cameras share: the target that is looked for, what a view shows, and what is said of it."""
