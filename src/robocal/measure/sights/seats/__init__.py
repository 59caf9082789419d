"""Targets that stand still against one another: what sights say of each of them."""
