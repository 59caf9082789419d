"""The Python front door: what the names of `import robocal` stand for. The same verbs as the command line's."""
