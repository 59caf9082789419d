"""What the numbers mean, in words: the verdict, and what was proven on measurements that nothing was fitted to."""

from __future__ import annotations

import math
from typing import Any

from robocal.remarks.code import Code
from robocal.remarks.remark import singular
from robocal.report.sections import Style, VerdictBlock, figure

__all__ = ["PRAISED", "PROOFS", "proof", "proof_of", "times_smaller", "verdict"]

VerdictText = tuple[str, Style, str]
VERDICTS: dict[str, VerdictText] = {
    "improved": (
        "improved",
        "good",
        "The corrected model is better than the nominal one, and the gain is proven on measurements that it had not seen.",
    ),
    "improved where measured": (
        "improved where measured",
        "doubtful",
        "The gain is proven on measurements that the model had not seen, near the others; for the rest of the working range it is "
        "not.",
    ),
    "located": (
        "located",
        "good",
        "The frames are where these measurements say, and measurements that were not used agree. The robot is as it was.",
    ),
    "not_improved": ("not improved", "doubtful", "A better model was not proven. Keep the nominal one."),
    "refused": (
        "refused",
        "bad",
        "The model does not explain these measurements. Do not use the identified parameters; they are listed for diagnosis only.",
    ),
}  # fmt: skip
PRAISED = ("improved", "improved where measured", "located")
PROOFS = {"held_out": "Held out", "k_fold": "Every fold", "leave_one_out": "Leave one out"}
MANY = 1000  # times: beyond, only digits are counted


def proof_of(residuals: Any) -> str:
    """The first way of holding out that there is, "" where nothing was."""
    return next((name for name in PROOFS if getattr(residuals, name) is not None), "")


def verdict(result: Any, brief: bool = False) -> VerdictBlock:
    """The verdict of a result, with what to do where it is not `improved`, each advice once; `brief`: its first reason alone."""
    said = result.verdict
    measured = said.status == "improved" and said.region == "measured"
    status = "improved where measured" if measured else str(said.status)
    word, style, meaning = VERDICTS[status]
    if brief:
        return VerdictBlock(word, style, tuple(said.reasons[:1]))
    advice = [] if status in ("improved", "located") else [r.advice for r in said.remarks if r.advice]
    posed = result.pose_from_lengths
    # A factor is praise: beside a model that is not to be used it would contradict the verdict.
    praise = status in PRAISED
    told = proof(result.residuals, praise) if posed is None else proof_of_poses(posed, praise)
    if style == "good" and proof_of(posed or result.residuals):
        told = ""  # what good news rests on stands in large numbers beside it
    reasons = list(said.reasons)
    if status == "refused":  # a gain that nobody should act on is no reason
        anyway = [r.sentence for r in said.remarks if r.code == Code.GAIN_ANYWAY]
        reasons = [r for r in reasons if r not in anyway]
        told = " ".join(filter(None, (told, *(f"In numbers: {r}." for r in anyway))))
    return VerdictBlock(word, style, tuple(reasons), tuple(dict.fromkeys(advice)), meaning, singular(told))


def times_smaller(before: float | None, after: float | None) -> str:
    """The factor between two errors in words, or nothing where it says nothing."""
    if before is None or after is None or not (before > 0 and after > 0):
        return ""
    ratio = before / after
    if 0.95 < ratio < 1.05:
        return "about the same"
    word = "smaller" if ratio > 1 else "larger"
    ratio = max(ratio, 1 / ratio)
    if ratio >= MANY:
        return f"more than {MANY} times {word}"
    shown = f"{ratio:.0f}" if ratio >= 9.5 else f"{ratio:.1f}" if ratio >= 1.95 else f"{ratio:.2f}"
    return f"{shown} times {word}"


def proof_of_poses(posed: Any, praise: bool = True) -> str:
    """One sentence: what a cable robot is off by where lengths alone say where it is, and its lengths beside that; with the factors
    where there is something to praise."""
    told = []
    for found, what in ((posed, "the position"), (posed.angle, "the orientation"), (posed.lengths, "the lengths")):
        for name in ("held_out", "k_fold", "leave_one_out"):
            before, after = found and getattr(found, f"{name}_before"), found and getattr(found, name)
            if before is not None and after is not None:
                factor = times_smaller(before.mean, after.mean) if praise else ""
                amounts = f"from {figure(before.mean, 3)} to {figure(after.mean, 3)} {found.unit}"
                told.append(f"{what} {amounts}{f' ({factor})' if factor else ''}")
    count = next(s.n for n in ("held_out", "k_fold", "leave_one_out") if (s := getattr(posed, n)) is not None)
    return f"On {count} poses that the identification never saw, mean errors of the pose from lengths went: {'; '.join(told)}."


def proof(residuals: Any, praise: bool = True) -> str:
    """One or two sentences: what the unseen measurements say, or that there were none; with the factor where there is something to
    praise."""

    def mean(name: str) -> float | None:
        found = getattr(residuals, name)
        return None if found is None or not math.isfinite(found.mean) else float(found.mean)

    def show(value: float | None) -> str:
        return f"{figure(value, 3)} {residuals.unit}"

    held, held_before = mean("held_out"), mean("held_out_before")
    if held is not None:
        head = f"On {residuals.held_out.n} measurements that the identification never saw, the mean error "
        if held_before is not None:
            factor = times_smaller(held_before, held) if praise else ""
            return f"{head}went from {show(held_before)} to {show(held)}{f': {factor}' if factor else ''}."
        before = mean("before")
        rest = "" if before is None else f"; the nominal model, over all measurements, leaves {show(before)}"
        return f"{head}is {show(held)}{rest}."
    folded, folded_before = mean("k_fold"), mean("k_fold_before")
    if folded is not None:
        rounds = f"in {len(residuals.folds)} folds, " if residuals.folds else ""  # of frames alone they are not listed
        text = f"Everything was held out once, {rounds}"
        text += "and predicted by a model that was fitted to the others: "
        factor = times_smaller(folded_before, folded)
        went = f"the mean error went from {show(folded_before)} to" if factor else "the mean error is"
        return f"{text}{went} {show(folded)}{f', {factor}' if factor and praise else ''}."
    single, before, after = mean("leave_one_out"), mean("before"), mean("after")
    if single is not None:
        text = "No set was held out as a whole; each configuration was predicted from all the others instead. "
        text += f"That mean error is {show(single)}"
        # Like is compared with like: the nominal model's frames had not seen the pose either, where that is known.
        plain = mean("leave_one_out_before")
        plain = before if plain is None else plain
        if plain is not None:
            factor = times_smaller(plain, single)
            text += f", against {show(plain)} with the nominal model" + (f": {factor}" if factor and praise else "")
        constant = mean("constant")
        less = "" if constant is None else f" Predicting the mean of the others misses by {show(constant)}."
        return f"{text}.{less}"
    if after is not None:
        return (
            f"Nothing was held out. The error of {show(after)} was computed on the measurements that the model was fitted to, "
            "so it shows how well the model bends to them and is no proof that it predicts others."
        )
    return "No errors were recorded, so nothing is proven."
