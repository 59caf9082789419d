"""How to identify, told once, and where the correction should hold: the verb has its defaults from here. Cheap to import."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from robocal._record import field, record

if TYPE_CHECKING:
    from robocal._types import Array

__all__ = ["JointRegion", "Options"]


@record(eq=False)
class JointRegion:
    """Joint configurations (m, n) that stand for a part of joint space, and its name."""

    joints: Array
    name: str


@record
class Options:
    """How to identify; what was used is kept with the result.

    `hold_out` says what is kept for judging: None, stated groups, else a fifth of the places, or leave-one-out alone below 25 of
    them; a share, spread over joint space; "blocks", `blocks` blocks of rows in time order, of which a fifth is held
    out; "group", whole groups (`Configurations.groups`, or the data files), a fifth of them. With `folds` everything
    is held out once, in so many rounds, in the same way: five shares, five blocks, or the groups dealt to five rounds
    (as many folds as groups: each in turn); the model is then fitted to everything. `reselect` (with `folds`) repeats
    start, noise and selection in every round: strict, and as slow as so many identifications. Without it the rounds
    keep the columns and the noise of the fit to everything, as leave-one-out does.

    `keep_all` frees every parameter that says so, without dropping what cannot be seen (the blind methods do so by
    themselves). `particles` is how many the particle filter takes, `bootstrap` how many times the places are drawn
    again to see how far the parameters scatter. `tolerance` (m) stops iterations at a greatest error. `region` is the working range
    in which the correction should hold (the box of the measured joints), `measured` says that it need not hold farther than it was
    measured. `begin` has values (SI) of the robot's parameters that are known to be far from where they are written: fits begin there.
    """

    method: str = "lm"
    hold_out: float | str | None = None
    seed: int = 0
    loss: str = "none"
    tuning: float | None = None
    max_iterations: int = 100
    leave_one_out: bool | None = None
    keep_all: bool = False
    priors: bool = True
    folds: int | None = None
    blocks: int = 10
    reselect: bool = False
    particles: int = 1000
    bootstrap: int | None = None
    region: JointRegion | None = None
    measured: bool = False
    tolerance: float | None = None
    begin: Mapping[str, float] = field(default_factory=dict)
