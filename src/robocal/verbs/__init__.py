"""One verb, one module or folder: `Options` (stated once), `run(options, watch, command) -> Outcome`, `sections(outcome)`.

Of a folder, `__init__` is the verb, `result` what it finds, `page` its report. Importing a verb is cheap: what it needs is imported
when it runs, so that help answers at once. A verb imports no other verb, but `demo`, whose cases are made of them.
"""
