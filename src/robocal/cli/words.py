"""Options whose value may be left out: the word that stands for it is put in before typer reads the line."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["complete"]


def complete(words: Sequence[str]) -> list[str]:
    """The command line with `--compare all` for a `--compare` that no method follows: a word with a comma or one of the
    estimators' names is its value, anything else is not."""
    out: list[str] = []
    for i, word in enumerate(words):
        out.append(word)
        if word == "--compare":
            from robocal.verbs.identify import METHODS

            following = words[i + 1] if i + 1 < len(words) else ""
            if not ("," in following or following in (*METHODS, "all")):
                out.append("all")
    return out
