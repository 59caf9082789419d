"""What verbs are made of: inputs read and doubted, results with their documents and files.

Nothing here writes to a terminal.
"""
