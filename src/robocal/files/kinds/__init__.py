"""How each kind of measurement is read from columns.

A new kind of data is one file here (the model of its keys in data.yaml, a function from columns to values in SI) and
one line in `registry.py`.
"""
