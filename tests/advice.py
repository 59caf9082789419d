"""A table of advice that was obeyed: for each code what makes it appear, and what is seen after its line was followed."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from cli.runs import Ran, robocal
from worlds import Arm, Cables

from robocal.diagnose.check_registry import ALL, checks
from robocal.remarks.english import DECLARED, TABLE, phrase_of

Obedience = Callable[[Path], tuple[Ran, Ran]]
OBEYED: dict[str, Obedience] = {}
UNSEEN = ("held_out", "k_fold", "leave_one_out")
RANK = {0: 2, 3: 1, 2: 0}
SIGMA = 1e-4


def advised() -> set[str]:
    """Every code that says what to do."""
    for package in ALL:
        checks(package)
    return {code for code in (*TABLE, *DECLARED) if phrase_of(code).advice}


def obeyed(*codes: str) -> Callable[[Obedience], Obedience]:
    def register(make: Obedience) -> Obedience:
        for code in codes:
            assert code not in OBEYED, code
            OBEYED[code] = make
        return make

    return register


def spoken(ran: Ran, code: str) -> bool:
    """Whether the sentence of a code stands in what was printed."""
    template = re.sub(r"\[[^\[\]]*\]", "\0", phrase_of(code).sentence)
    words = re.escape(re.sub(r"\{[^{}]*\}", "\1", template))
    pattern = (
        words.replace("\0", ".*?").replace("\1", ".+?").replace("rows", "rows?").replace("\\ are\\ ", "\\ (are|is)\\ ")
    )
    # Dots that reach over a whole document take minutes where a sentence is not in it.
    pieces = re.split(r"\{[^{}]*\}|\x00|rows| are ", template)
    return all(piece in ran.said for piece in pieces) and re.search(pattern, ran.said) is not None


def unseen(ran: Ran) -> float | None:
    """Mean error of unseen measurements, where there is one."""
    try:
        found = ran.document["residuals"]
    except (ValueError, KeyError):
        return None
    found = found[0] if isinstance(found, list) else found
    return next((found[n]["mean"] for n in UNSEEN if found.get(n)), None)


def is_better(first: Ran, then: Ran, code: str) -> bool:
    """The status is better; or the remark is gone and the status no worse; or unseen errors are clearly smaller."""
    rise = RANK.get(then.status, -1) - RANK.get(first.status, -1)
    before, after = unseen(first), unseen(then)
    less = before is not None and after is not None and after < 0.9 * before
    return rise > 0 or (rise == 0 and (less or not spoken(then, code)))


def identify(files, *options) -> Ran:
    return robocal("identify", *files, *options, "--json")


def draw(m=40, seed=0, arm="six", size=1.0, share=0.8):
    """Nominal and true arm, joint values and a generator."""
    rng = np.random.default_rng(seed)
    nominal = Arm.nominal(arm)
    return nominal, nominal.true(rng, size), nominal.draw(rng, m, share), rng


def see(true, q, rng, noise=SIGMA):
    return true.point(q) + rng.normal(size=(len(q), 3)) * noise + [0.5, 0.2, 0.1]


def write(folder, nominal, q, p, sigma=SIGMA, more="", name=""):
    """Robot and data in a folder of their own."""
    place = folder / name if name else folder
    place.mkdir(exist_ok=True)
    return [place / f for f in nominal.write(place, q, p, sigma, more)]


def arm(folder, m=40, seed=0, noise=SIGMA, sigma=SIGMA, name="", spoil=None, **how):
    """Files of a simulated arm; `spoil` changes joint values and readings."""
    nominal, true, q, rng = draw(m, seed, **how)
    p = see(true, q, rng, noise)
    if spoil is not None:
        q, p = spoil(q.copy(), p.copy(), rng)
    return write(folder, nominal, q, p, sigma, name=name)


def cables(folder, m=40, seed=0, name="eight", spoil=None, place="", sigma=1e-3, zero=5e-3, size=8e-3, step=None):
    """Files of a simulated cable robot; `spoil` changes lengths, positions and rotation vectors."""
    rng = np.random.default_rng(seed)
    nominal = Cables.nominal(name, rng)
    true = nominal.true(rng, size, zero)
    p, w = nominal.draw(rng, m) if step is None else nominal.way(rng, m, step)
    y = true.lengths(p, w) + rng.normal(size=(m, len(true.a))) * sigma
    p = p + rng.normal(size=p.shape) * sigma * ([1, 0, 1] if nominal.planar else 1)
    w = w + rng.normal(size=w.shape) * sigma * ([0, 1, 0] if nominal.planar else 1)
    if spoil is not None:
        y, p, w = spoil(y.copy(), p.copy(), w.copy())
    at = folder / place if place else folder
    at.mkdir(exist_ok=True)
    return [at / f for f in nominal.write(at, y, p, w, sigma)]


def edit(file: Path, *changes: tuple[str, str]) -> None:
    """Text of a file with other words; each must be there."""
    text = file.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text, (old, text)
        text = text.replace(old, new)
    file.write_text(text, encoding="utf-8")


def beside(files) -> Path:
    """The table of a data file."""
    return files[1].with_suffix(".csv")


def found(ran: Ran, pattern: str) -> str:
    """What a pattern finds in what was printed."""
    hit = re.search(pattern, ran.said)
    assert hit, (pattern, ran.said)
    return hit[1]
