"""What several verbs share of cable robots: robot and lists opened, poses to start from, readings before a fit."""
