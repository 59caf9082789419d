"""The groups beyond geometry by name: what may be stated of each, and how it is added to a chain.

    gain  eccentricity  ripple  backlash  compliance  sag  bending  expansion

Options are plain SI values; a chain keeps them with the names of the parameters that each group added, so that it can
be written to a file and read again.

Gravity compliance needs masses. Those of published arms stand here with the source of every number: mass (kg) and centre of mass (m) of
each link in the frame in which its row of the published DH table ends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from robocal._record import record, replace
from robocal.arms import joints
from robocal.arms.chain import Chain, Group
from robocal.arms.gravity_load import Load, Triple
from robocal.errors import ModelError, look_up, one_of

__all__ = ["GROUPS", "Rule", "add", "catalog_loads", "fix_groups", "free_groups", "rule_of", "without"]

Options = Mapping[str, Any]


@record
class Rule:
    """A group: its options, the SI unit of its prior, the function that adds it by these options, and what it needs to be recorded."""

    name: str
    options: tuple[str, ...]
    unit: str
    add: Callable[..., Chain]
    needs: str = ""


def _ripple(chain: Chain, *, highest: int = 0, **options: Any) -> Chain:
    """Orders that are not stated are sought in the data, up to the `highest`."""
    within = options.pop("range", None)
    return joints.with_eccentricity(chain, within=within, **{"harmonics": {}} | options)


def _with_loads(add: Callable[..., Chain]) -> Callable[..., Chain]:
    """The same with masses as stated, else as published; a payload alone may do, and a recorded torque needs none."""

    def of(chain: Chain, *, links: Iterable[Load] | None = None, payload_only: bool = False, **options: Any) -> Chain:
        if options.get("torque") == "recorded":
            return add(chain, **options)
        loads = catalog_loads(chain) if links is None else tuple(links)
        if not loads and not payload_only:
            raise ModelError(
                "the masses of this robot's links are not known", key="groups", found=chain.name,
                expected="compliance: {links: [{joint, mass, com}, ...]} in robot.yaml, or the group sag, which needs none",
            )  # fmt: skip
        return add(chain, loads=loads, **options)

    return of


OF_LOADS = ("joints", "prior", "gravity", "links", "payload_only")
OF_TORQUE = ("joints", "prior", "gravity", "torque", "links", "payload_only")
GROUPS = {
    rule.name: rule
    for rule in (
        Rule("gain", ("joints", "prior"), "1", joints.with_gains),
        Rule("eccentricity", ("joints", "prior", "harmonics"), "rad", joints.with_eccentricity),
        Rule("ripple", ("joints", "prior", "harmonics", "highest", "range"), "rad", _ripple),
        Rule("backlash", ("joints", "prior"), "rad", joints.with_backlash, "approach.JOINT"),
        Rule("compliance", OF_TORQUE, joints.COMPLIANCE, _with_loads(joints.with_compliance)),
        Rule("sag", ("joints", "prior", "gravity"), joints.SAG, joints.with_sag),
        Rule("bending", OF_LOADS, joints.COMPLIANCE, _with_loads(joints.with_bending)),
        Rule("expansion", ("prior", "reference", "per_joint"), "1/K", joints.with_expansion, "temperature"),
    )
}


def rule_of(name: str) -> Rule:
    """The group with this name. Raises ModelError with the nearest one."""
    return look_up(GROUPS, name, "unknown group", "groups")


def add(chain: Chain, name: str, options: Options | None = None) -> Chain:
    """The chain with a group; its parameters are free and hold their priors. Raises ModelError for what the group does
    not know."""
    rule, options = rule_of(name), dict(options or {})
    for key in options:
        if key not in rule.options:
            raise ModelError("unknown option of a group", key=f"groups.{name}.{key}", **one_of(key, rule.options))
    if any(g.name == name for g in chain.groups):
        raise ModelError("this group is there already", key=f"groups.{name}")
    made = rule.add(chain, **options)
    before = {p.name: p for p in chain.table.rows}
    own = tuple(p.name for p in made.table.rows if before.get(p.name) != p)
    return replace(made, groups=(*chain.groups, Group(name, options, own)))


def fix_groups(chain: Chain) -> Chain:
    """The chain with all groups' parameters fixed at their values."""
    fixed = {p for g in chain.groups for p in g.parameters}
    return replace(chain, table=chain.table.with_free(n for n in chain.table.free if n not in fixed))


def free_groups(chain: Chain, names: Iterable[str]) -> Chain:
    """The chain with some groups' parameters free."""
    freed = {p for g in chain.groups if g.name in set(names) for p in g.parameters}
    return replace(chain, table=chain.table.with_free({*chain.table.free, *freed}))


def without(chain: Chain, name: str) -> Chain:
    """The chain without a group that added no parameter yet, such as ripple whose orders are to be sought. Raises
    ModelError for one that did: its terms stay."""
    group = next((g for g in chain.groups if g.name == name), None)
    if group is None or group.parameters:
        raise ModelError("this group cannot be taken away", key=f"groups.{name}")
    return replace(chain, groups=tuple(g for g in chain.groups if g is not group))


Row = tuple[float, Triple]
# Universal Robots, DH parameters for calculations of kinematics and dynamics (CB3 UR10); frames of the classic DH table.
UR10: tuple[Row, ...] = (
    (7.1, (0.021, 0.0, 0.027)),
    (12.7, (0.38, 0.0, 0.158)),
    (4.27, (0.24, 0.0, 0.068)),
    (2.0, (0.0, 0.007, 0.018)),
    (2.0, (0.0, 0.007, 0.018)),
    (0.365, (0.0, 0.0, -0.026)),
)
# Gaz, Cognetti, Oliva, Robuffo Giordano and De Luca, Dynamic identification of the Franka Emika Panda robot with
# retrieval of feasible parameters using penalty-based optimization (2019), as in franka_ros; frames of modified DH.
PANDA: tuple[Row, ...] = (
    (4.970684, (3.875e-3, 2.081e-3, -4.762e-2)),
    (0.646926, (-3.141e-3, -2.872e-2, 3.495e-3)),
    (3.228604, (2.7518e-2, 3.9252e-2, -6.6502e-2)),
    (3.587895, (-5.317e-2, 1.04419e-1, 2.7454e-2)),
    (1.225946, (-1.1953e-2, 4.1065e-2, -3.8437e-2)),
    (1.666555, (6.0149e-2, -1.4117e-2, -1.0517e-2)),
    (0.735522, (1.0517e-2, -4.252e-3, 6.1597e-2)),
)
PUBLISHED = {("Universal Robots UR10", ("dh", "dh-hayati")): UR10, ("Franka Emika Panda", ("mdh", "mdh-hayati")): PANDA}


def catalog_loads(chain: Chain) -> tuple[Load, ...]:
    """The published masses of an arm of this name in this convention, link by link; none where no values are published."""
    for (name, conventions), rows in PUBLISHED.items():
        if chain.name == name and chain.convention in conventions and len(rows) == len(chain.joints):
            return tuple(Load(j, m, at) for j, (m, at) in zip(chain.joint_names, rows, strict=True))
    return ()
