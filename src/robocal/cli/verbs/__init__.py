"""The verbs' options as typer reads them; only cheap imports. What they do is in `cli/acts`."""
