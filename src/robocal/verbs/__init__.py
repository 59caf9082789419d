"""One verb, one module: `Options` (told once), `run(options, watch, command) -> Outcome`, `sections(outcome)`.

Importing a verb is cheap: what it needs is imported when it runs, so that help answers at once. A verb imports no other verb, but
`demo`, whose `stories` are made of them.
"""
