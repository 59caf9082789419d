"""What is said of images of a target: what is wrong with them, and what to do."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from robocal.diagnose.vision_limits import FRONTAL, IMAGE_BLUR, IMAGE_COVERAGE, IMAGE_SMEAR, IMAGE_VIEWS, IMAGE_WHITE
from robocal.remarks.code import Code
from robocal.remarks.remark import Remark
from robocal.session.vision.target import Target
from robocal.session.vision.views import ViewSummary

__all__ = ["judge_views"]

SHOWN = 8  # grid: markers of a group that are named


def judge_views(
    views: Sequence[ViewSummary], islands: Sequence[Sequence[int]], coverage: float, target: Target
) -> tuple[list[Remark], list[Remark]]:
    """Remarks, and reasons why the corners must not be trusted."""
    said: list[Remark] = []
    total = len(views)
    full = [v for v in views if v.corners]
    sizes = Counter((v.width, v.height) for v in views)
    reasons: list[Remark] = []
    if len(sizes) > 1:
        usual = sizes.most_common(1)[0][0]
        odd = [v for v in views if (v.width, v.height) != usual]
        names = tuple(v.view for v in odd)
        (width, height), most = (odd[0].width, odd[0].height), f"{usual[0]} x {usual[1]}"
        reasons.append(
            Remark.of(Code.IMAGE_SIZES_DIFFER, count=len(sizes), views=names, width=width, height=height, usual=most)
        )
    mirrored = tuple(v.view for v in views if v.mirrored)
    if mirrored:
        reasons.append(Remark.of(Code.MIRRORED_IMAGE, count=len(mirrored), total=total, views=mirrored))

    def tell(code: str, some: Sequence[ViewSummary], **facts: float | tuple[str, ...]) -> None:
        if some:
            said.append(Remark.of(code, count=len(some), total=total, views=tuple(v.view for v in some), **facts))

    tell(Code.IMAGE_TURNED, [v for v in views if v.turned])
    if not full:
        board = f"a {target.text} was looked for"
        several = f"{target.text} were looked for"
        what = board if target.squares is not None else several
        if target.text == "none":
            what = "all dictionaries and checkerboards were tried"
        reasons.append(Remark.of(Code.NO_TARGET_FOUND, tried=what))
        return [*said, *_left_out(views), *_dropped(views)], reasons
    tell(Code.NO_MARKER_IN_VIEW, [v for v in views if not v.corners])
    if target.family is not None and target.squares is None:
        one = [v for v in full if v.markers == 1]
        if len({n for i in islands for n in i}) > 1:  # of a target that is one marker there is no more to see
            tell(Code.ONE_MARKER_IN_VIEW, one)
        flat = [v for v in one if min(v.tilts, default=FRONTAL) < FRONTAL]
        tilts = tuple(" or ".join(f"{t:.1f}" for t in sorted(v.tilts)) + " deg" for v in flat)
        tell(Code.MARKER_HAS_TWO_POSES, flat, most=FRONTAL, tilts=tilts)
        if len(islands) > 1:
            groups = tuple(" ".join(map(str, i[:SHOWN])) + (" ..." if len(i) > SHOWN else "") for i in islands)
            said.append(Remark.of(Code.MARKERS_APART, count=len(islands), groups=groups))
    said += _left_out(views)
    tell(Code.IMAGE_OVEREXPOSED, [v for v in full if v.white > IMAGE_WHITE])
    smeared = [v for v in full if v.motion >= IMAGE_SMEAR]
    if smeared:
        far = max(smeared, key=lambda v: v.motion)
        worst, length, angle = far.view, far.motion, far.direction
        said.append(
            Remark.of(Code.MOTION_BLUR, count=len(smeared), total=total, view=worst, length=length, angle=angle)
        )
    tell(
        Code.IMAGE_BLURRED,
        [v for v in full if v.blur is not None and v.blur > IMAGE_BLUR and v not in smeared],
        most=IMAGE_BLUR,
    )
    markers = sum(v.markers for v in views)
    for code, name in ((Code.MARKERS_AT_BORDER, "border"), (Code.EDGES_ALONE, "edges")):
        some = [v for v in full if getattr(v, name)]
        if some:
            count = sum(getattr(v, name) for v in some)
            said.append(Remark.of(code, count=count, total=markers, views=tuple(v.view for v in some)))
    said += _dropped(views)
    if len(full) >= IMAGE_VIEWS and coverage < IMAGE_COVERAGE:
        said.append(Remark.of(Code.IMAGE_HARDLY_COVERED, share=coverage))
    if target.family is None and target.squares is not None and sum(target.squares) % 2 == 0:
        columns, rows = target.squares
        said.append(Remark.of(Code.BOARD_TURNS, columns=columns, rows=rows))
    lacks = [("marker", "--size")] if target.size is None and target.family is not None else []
    lacks += [("square", "--square")] if target.square is None and target.squares is not None else []
    said += [Remark.of(Code.SIZE_NOT_STATED, what=what, option=name) for what, name in lacks]
    return said, reasons


def _left_out(views: Sequence[ViewSummary]) -> Iterator[Remark]:
    """Markers that the sheet does not have, and numbers that an image shows twice."""
    strange = tuple(sorted({n for v in views for n in v.strangers}))
    if strange:
        yield Remark.of(Code.MARKERS_OFF_SHEET, numbers=strange)
    for view in views:
        if view.twice:
            yield Remark.of(Code.TWO_OF_ONE_NUMBER, view=view.view, numbers=view.twice)


def _dropped(views: Sequence[ViewSummary]) -> Iterator[Remark]:
    """Markers that were found and not fitted."""
    lost = [v for v in views if v.dropped]
    if lost:
        names = tuple(v.view for v in lost)
        yield Remark.of(Code.MARKER_DROPPED, count=sum(len(v.dropped) for v in lost), views=names)
