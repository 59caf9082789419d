"""Advice on cable robots and their calibration, obeyed."""

from __future__ import annotations

import re

from advice import cables, edit, found, identify, obeyed
from cli.runs import robocal


@obeyed("scale-of-drums")
def drums(folder):
    files = cables(folder, 60, spoil=lambda y, p, w: (1.01 * y, p, w))
    first = identify(files)
    line = found(first, r"write (gain: \{free: true\}) into")
    files[1].write_text(files[1].read_text() + line + "\n")
    return first, identify(files)


@obeyed("cable-zeros-unknown")
def zeros(folder):
    files = cables(folder, 60, zero=0.4)
    first = identify(files)
    files[1].write_text(files[1].read_text() + "zeros: power-up\n")
    return first, identify(files)


@obeyed("segment-of-zero")
def slipped(folder):
    def slip(y, p, w):
        y[35:, 2] += 0.012
        return y, p, w

    files = cables(folder, 60, spoil=slip)
    first = identify(files)
    return first, identify(files, "--exclude", found(first, r"--exclude (\w+-\w+)"))


@obeyed("lengths-exchanged")
def exchanged(folder):
    """Three cables in turn: columns that are called as cables are read by name, others as the data file lists them."""
    files = cables(folder, spoil=lambda y, p, w: (y[:, [1, 2, 0, *range(3, 8)]], p, w))
    table = files[1].with_suffix(".csv")
    first = identify(files)
    titles = found(first, r"the titles (c[^\"]*?) where the table has c1, c2").split(", ")
    head, _, rest = table.read_text().partition("\n")
    table.write_text(",".join(["id", *(f"{t} [mm]" for t in titles)]) + "\n" + rest)
    then = identify(files)
    edit(files[1], ("columns: [c1, c2, c3, c4, c5, c6, c7, c8]", "columns: [m1, m2, m3, m4, m5, m6, m7, m8]"))
    table.write_text(",".join(["id", *(f"m{i} [mm]" for i in range(1, 9))]) + "\n" + rest)
    line = found(identify(files), r"expected (columns: \[[^\]]*\])")
    edit(files[1], ("columns: [m1, m2, m3, m4, m5, m6, m7, m8]", line))
    again = identify(files)
    return first, again if then.status == 0 else then


@obeyed("anchors-exchanged")
def anchors(folder):
    files = cables(folder)
    text = files[0].read_text()
    wrong = re.sub(r"platform: B1, zero", "platform: X, zero", text, count=1)
    wrong = re.sub(r"platform: B2, zero", "platform: B1, zero", wrong, count=1).replace("platform: X,", "platform: B2,")
    files[0].write_text(wrong)
    first = identify(files)
    files[0].write_text(text)
    return first, identify(files)


@obeyed("two-sizes")
def sizes(folder):
    """Fifty times as far: no unit that is written for another does so."""
    return identify(cables(folder, spoil=lambda y, p, w: (y, 50 * p, w))), identify(cables(folder))


@obeyed("motions-unseen")
def unseen_motions(folder):
    files = cables(folder, 60)
    return identify(files[:2]), identify(files)


@obeyed("place-open")
def place(folder):
    files = cables(folder, 80)
    return identify(files[:2]), identify(files)


@obeyed("too-few-poses")
def few(folder):
    return identify(cables(folder, 6)[:2]), identify(cables(folder, 60))


@obeyed("worse-than-unmeasured")
def worse(folder):
    return identify(cables(folder, 12, name="four")[:2]), identify(cables(folder, 60, name="four"))


@obeyed("configurations-copied")
def copies(folder):
    def copy(y, p, w):
        y[5:35], p[5:35], w[5:35] = y[:1], p[:1], w[:1]
        return y, p, w

    files = cables(folder, spoil=copy)
    first = identify(files)
    for file in files[1:]:
        table = file.with_suffix(".csv")
        rows = table.read_text().splitlines()
        table.write_text("\n".join([*rows[:6], *rows[36:]]) + "\n")
    return first, identify(files)


@obeyed("same-frame-point")
def same_point(folder):
    files = cables(folder)
    text = files[0].read_text()
    point = re.search(r"  A1: (\[.*\])", text)[1]
    files[0].write_text(re.sub(r"  A2: \[.*\]", f"  A2: {point}", text))
    first = robocal("check", *files)
    files[0].write_text(text)
    return first, robocal("check", *files)


@obeyed("anchors-unused")
def spare(folder):
    files = cables(folder)
    edit(files[0], ("frame_anchors:\n", "frame_anchors:\n  A9: [1, 2, 3]\n"))
    first = robocal("check", *files)
    edit(files[0], ("  A9: [1, 2, 3]\n", ""))
    return first, robocal("check", *files)
