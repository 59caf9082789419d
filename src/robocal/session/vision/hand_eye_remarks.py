"""What every identification says of a verdict, in the words and by the options of hand-eye calibration."""

from __future__ import annotations

from robocal._record import replace
from robocal.diagnose.camera_views import AXES_EXCHANGED, TARGET_TURNED
from robocal.prove.verdict import Verdict
from robocal.remarks.code import Code
from robocal.remarks.remark import Quantity, Remark
from robocal.session.vision.hand_eye_data import HandEyeData
from robocal.session.vision.hand_eye_errors import HandEyeErrors

__all__ = ["restate", "tell_lens"]

LENS_FACTOR = "lens-factor"  # the code of a lens of images of another size
# Numbers of a fit whose frames are lost mean nothing.
OF_A_FIT = (Code.FRAMES_NOT_EXPLAINED, Code.NO_BETTER_THAN_MEAN, Code.UNEXPLAINED, Code.NOT_CONVERGED)
OF_FEW = (Code.FEW_UNSEEN, Code.FEW_PLACES)


def restate(said: Remark, opened: HandEyeData, errors: HandEyeErrors) -> Remark:
    """The same remark as this verb says it."""
    numbers = said.numbers
    if said.code == Code.NUMBER_WRONG:
        symbol = str(numbers["name"]).rpartition(".")[2]
        change = f"{symbol} {_plain(numbers['stated'])} given, {_plain(numbers['there'])} found"
        return Remark.of(Code.LENS_CONTRADICTED, names=(change,), z=numbers["z"])
    if said.code == LENS_FACTOR:
        change = f"{numbers['name']}: {_plain(numbers['factor'])} times what was given found"
        return Remark.of(Code.LENS_CONTRADICTED, names=(change,), z=numbers["z"])
    if said.code == TARGET_TURNED:
        asked = {k: numbers[k] for k in ("count", "total", "views", "stated", "left")}
        return Remark.of(Code.LABELS_TURNED, **asked)
    if said.code == AXES_EXCHANGED:
        return Remark.of(said.code, **{**numbers, "line": "u is v, and v is u"})
    if said.code in OF_FEW:
        return Remark.of(Code.HAND_EYE_FEW_VIEWS, count=len(opened.views))
    if errors.lost and said.code in OF_A_FIT:
        return Remark.of(Code.HAND_EYE_LOST)
    if said.code == Code.NOT_CONVERGED:
        return Remark.of(Code.HAND_EYE_NOT_CONVERGED)
    if said.code == Code.FRAMES_NOT_EXPLAINED:
        amounts = {k: numbers[k] for k in ("left", "allowed", "times", "how")}
        return Remark.of(Code.HAND_EYE_NOT_EXPLAINED, **amounts)
    return said


def tell_lens(verdict: Verdict, lens: Remark | None, material: bool) -> tuple[Verdict, list[Remark], bool]:
    """The verdict with all that contradicts a lens in one remark, the `lens` as views alone tell it among it; and what else is said.
    `material`: it puts a camera elsewhere; told as well."""
    reasons = [r for r in verdict.reasons if r.code == Code.LENS_CONTRADICTED]
    if lens is not None and not reasons and not material:
        return verdict, [lens], material
    every = [*([] if lens is None else [lens]), *reasons]
    if not every:
        return verdict, [], material
    # What views alone tell is told of each number once; what a fit to the robot's poses tells is the same, or the robot's.
    names = [n for r in ([lens] if lens is not None else reasons) for n in _names(r)]
    most = max(float(r.numbers["z"]) for r in every)  # type: ignore[arg-type]
    one = Remark.of(Code.LENS_CONTRADICTED, names=tuple(dict.fromkeys(names)), z=most)
    rest = replace(verdict, reasons=tuple(r for r in verdict.reasons if r not in reasons))
    if material:
        return rest.instead("refused" if rest.status == "refused" else "not_improved", one), [], True
    at = verdict.reasons.index(reasons[0])
    return replace(verdict, reasons=(*rest.reasons[:at], one, *rest.reasons[at:])), [], False


def _names(said: Remark) -> tuple[object, ...]:
    names = said.numbers["names"]
    return names if isinstance(names, tuple) else (names,)


def _plain(value: object) -> str:
    """A number without its unit."""
    number = value.value if isinstance(value, Quantity) else value
    return f"{number:.5g}" if isinstance(number, int | float) else str(number)
