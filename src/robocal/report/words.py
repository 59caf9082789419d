"""What the numbers mean, in words: the verdict, what was proven and what was not, and what to do next."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from robocal.report.numbers import entries, finite, section, significant, with_unit

__all__ = [
    "Verdict",
    "advised",
    "chi2_word",
    "dropped_names",
    "hints",
    "proof",
    "reasons",
    "times_smaller",
    "trust",
    "verdict",
]


@dataclass(frozen=True)
class Verdict:
    """How a verdict is shown: `key` is its class in the style sheet."""

    key: str
    word: str
    meaning: str


_VERDICTS = {
    "improved": Verdict(
        "improved",
        "Improved",
        "The corrected model is better than the nominal one, and the gain is proven on measurements that it had not seen.",
    ),
    "not_improved": Verdict("not-improved", "Not improved", "A better model was not proven. Keep the nominal one."),
    "refused": Verdict(
        "refused",
        "Refused",
        "The model does not explain these measurements. Do not use the identified parameters; they are listed for diagnosis only.",
    ),
}
_MEASURED = Verdict(
    "not-improved",
    "Improved where it was measured",
    "The gain is proven on measurements that the model had not seen, near the others; for the rest of the working range it is not.",
)
_UNKNOWN = Verdict(
    "unknown", "No verdict", "The result carries no verdict, so nothing can be concluded from the numbers below."
)


def verdict(result: Mapping[str, object]) -> Verdict:
    """The verdict of a result."""
    told = section(result, "verdict")
    if (told.get("status"), told.get("region")) == ("improved", "measured"):
        return _MEASURED
    return _VERDICTS.get(str(told.get("status")), _UNKNOWN)


def reasons(result: Mapping[str, object]) -> list[str]:
    """The given reasons, as texts."""
    return [str(r) for r in entries(section(result, "verdict").get("reasons"))]


def hints(result: Mapping[str, object]) -> list[str]:
    """What to do next, where the verdict is not `improved`: the advice of its reasons, each once."""
    if verdict(result).key == "improved":
        return []
    found = [r.get("advice") for r in entries(section(result, "verdict").get("remarks")) if isinstance(r, Mapping)]
    return list(dict.fromkeys(str(a) for a in found if a))


def advised(found: Mapping[str, object], word: str = "warnings") -> list[tuple[str, str]]:
    """The sentences that a document lists under a word, each once and with what to do about it, "" where nothing is."""
    known = [r for r in entries(found.get("remarks")) if isinstance(r, Mapping)]
    advice = {str(r.get("sentence")): str(r.get("advice") or "") for r in known}
    return [(said, advice.get(said, "")) for said in dict.fromkeys(str(w) for w in entries(found.get(word)))]


def trust(result: Mapping[str, object]) -> list[str]:
    """What the working range and the scale of the arm say, as sentences."""
    told = [str(section(result, name).get("text") or "") for name in ("working_range", "scale")]
    return [t[0].upper() + t[1:] + "." for t in told if t]


def times_smaller(before: float | None, after: float | None) -> str:
    """The factor between two errors in words, or nothing where it says nothing."""
    if before is None or after is None or before <= 0 or after <= 0:
        return ""
    ratio = before / after
    if 0.95 < ratio < 1.05:
        return "about the same"
    word = "smaller" if ratio > 1 else "larger"
    ratio = max(ratio, 1 / ratio)
    shown = f"{ratio:.0f}" if ratio >= 9.5 else f"{ratio:.1f}" if ratio >= 1.95 else f"{ratio:.2f}"
    return f"{shown} times {word}"


def _mean(residuals: Mapping[str, object], name: str) -> float | None:
    return finite(section(residuals, name).get("mean"))


def proof(residuals: Mapping[str, object]) -> str:
    """One or two sentences: what the unseen measurements say, or that there were none."""
    unit = residuals.get("unit")

    def show(value: float | None) -> str:
        return with_unit(significant(value), unit)

    held, held_before = _mean(residuals, "held_out"), _mean(residuals, "held_out_before")
    single, before, after = (_mean(residuals, name) for name in ("leave_one_out", "before", "after"))
    if held is not None:
        n = finite(section(residuals, "held_out").get("n"))
        many = f"{n:.0f} " if n is not None else ""
        if held_before is not None:
            factor = times_smaller(held_before, held)
            return (
                f"On {many}measurements that the identification never saw, the mean error went from {show(held_before)} to {show(held)}"
                + (f": {factor}." if factor else ".")
            )
        return f"On {many}measurements that the identification never saw, the mean error is {show(held)}" + (
            f"; the nominal model, over all measurements, leaves {show(before)}." if before is not None else "."
        )
    folded, folded_before = _mean(residuals, "k_fold"), _mean(residuals, "k_fold_before")
    if folded is not None:
        rounds = len(entries(residuals.get("folds")))
        text = (
            f"Everything was held out once, in {rounds} folds, and predicted by a model that was fitted to the others: "
        )
        factor = times_smaller(folded_before, folded) if folded_before is not None else ""
        went = f"the mean error went from {show(folded_before)} to" if factor else "the mean error is"
        return f"{text}{went} {show(folded)}" + (f", {factor}." if factor else ".")
    if single is not None:
        text = "No set was held out as a whole; each configuration was predicted from all the others instead. "
        text += f"That mean error is {show(single)}"
        # Like is compared with like: the nominal model's frames had not seen the pose either, where that is known.
        plain = _mean(residuals, "leave_one_out_before")
        plain = before if plain is None else plain
        if plain is not None:
            factor = times_smaller(plain, single)
            text += f", against {show(plain)} with the nominal model" + (f": {factor}" if factor else "")
        constant = _mean(residuals, "constant")
        return text + (
            f". Predicting the mean of the others misses by {show(constant)}." if constant is not None else "."
        )
    if after is not None:
        return (
            f"Nothing was held out. The error of {show(after)} was computed on the measurements that the model was fitted to, "
            "so it shows how well the model bends to them and is no proof that it predicts others."
        )
    return "No errors were recorded, so nothing is proven."


def chi2_word(chi2: object, dof: object, source: object) -> str:
    """What chi2 / dof says about the stated noise, from a 95 % interval (Wilson and Hilferty's cube root)."""
    value, freedom = finite(chi2), finite(dof)
    if value is None or freedom is None or freedom <= 0:
        return ""
    if "estimated" in str(source):
        return "sigma was taken from these residuals, so this is 1 by construction and tests nothing"
    spread = math.sqrt(2 / (9 * freedom))
    low, high = ((1 - 2 / (9 * freedom) + z * spread) ** 3 for z in (-1.96, 1.96))
    ratio = value / freedom
    if ratio > high:
        return "more than the stated noise explains; for the sigmas as fitted, noise is added until this is one"
    if ratio < low:
        return "less than the stated noise; that sigma looks too large"
    return "as the stated noise predicts"


def dropped_names(identifiability: Mapping[str, object], parameters: Sequence[Mapping[str, object]]) -> list[str]:
    """Names of dropped parameters, from both places that know them, in order and once."""
    found: dict[str, None] = {}
    for item in entries(identifiability.get("dropped")):
        name = item.get("name") if isinstance(item, Mapping) else item
        if name is not None:
            found[str(name)] = None
    for row in parameters:
        if row.get("status") == "dropped":
            found[str(row.get("name", ""))] = None
    return list(found)
