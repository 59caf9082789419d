"""Compiled distances between a wrench and the polytope of wrenches that cables can balance."""
