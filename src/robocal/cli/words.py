"""What a command line says in another way: the words that stand for it are put in before typer reads the line."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["complete"]

OLD = {"--group": "--group-by"}  # spellings of the release before, still understood


def complete(words: Sequence[str]) -> list[str]:
    """The command line in today's spelling, with `--compare all` for a `--compare` that no method follows: a word with a comma or
    one of the estimators' names is its value, anything else is not."""
    out: list[str] = []
    for i, word in enumerate(words):
        name, sign, value = word.partition("=")
        out.append(OLD.get(name, name) + sign + value)
        if word == "--compare":
            from robocal.verbs.identify import METHODS

            following = words[i + 1] if i + 1 < len(words) else ""
            if not ("," in following or following in (*METHODS, "all")):
                out.append("all")
    return out
