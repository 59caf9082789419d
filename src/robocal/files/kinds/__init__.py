"""How each kind of measurement is read from columns.

A new kind of data is one file here, the model of its keys in data.yaml and a function from columns to values in SI; a line in
`registry.py` only where the file has another name than the kind.
"""
