"""Beyond geometry: what joints and links do that lengths and angles cannot say, as named groups of parameters.

Every function gives the chain back with parameters and terms added; a term is a coefficient times a column
(`columns.py`), so nothing else in the product changes.

    gain          q_j -> (1 + e) q_j                                    j.gain            [1]
    eccentricity  q_j -> q_j + sum_k c_k cos(k q_j) + s_k sin(k q_j)    j.cos1 j.sin1 ... [rad]
    backlash      q_j -> q_j + b sign of approach                       j.backlash        [rad]
    compliance    q_j -> q_j + c torque about the axis                  j.compliance      [rad/(N m)]
    sag           q_j -> q_j + sum_l s_l (torque of 1 kg at link l)     j.sag_l           [rad kg/(N m)]
    bending       Ru(c_u M_u) Rv(c_v M_v) behind the joint              j.bend_u j.bend_v [rad/(N m)]
    expansion     every length l -> l (1 + a (T - T_0))                 thermal.expansion [1/K], or one per joint

Sources: Whitney, Lozinski and Rourke, Industrial robot forward calibration method and results (1986) for gears,
eccentricity and compliance; Judd and Knasinski, A technique to calibrate industrial robots with experimental
verification (1990) for harmonics of the gear; Khalil and Besnard, Geometric calibration of robots with flexible
joints and links (2002) for gravity.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from robocal.arms.chain import Chain, drive_term
from robocal.arms.columns import ChainColumn, Growth, Harmonic, Recorded
from robocal.arms.gravity_load import Gravity, Load, Triple, axis_of, drive
from robocal.errors import ModelError, nearest
from robocal.geometry.gravity import GRAVITY
from robocal.geometry.path.program import Element, Term
from robocal.parameters import Parameter, ParameterTable

__all__ = [
    "orders_of", "turning", "with_backlash", "with_bending", "with_compliance", "with_eccentricity", "with_expansion", "with_gains",
    "with_sag",
]  # fmt: skip

COMPLIANCE, SAG = "rad/(N m)", "rad kg/(N m)"
# What a group's parameters are expected to be off by, unless a prior is stated: typical of geared arms.
GAIN, GEAR, SOFT, GROWTH = 1e-3, 3.5e-4, 5e-5, 2e-5


def turning(chain: Chain, joints: Sequence[str] = ()) -> tuple[str, ...]:
    """The named joints (default: those that turn). Raises ModelError for an unknown name or a joint that slides."""
    known = {j.name: j.type for j in chain.joints}
    for name in joints:
        if name not in known:
            raise ModelError("no joint has this name", key=name, suggestion=nearest(name, known))
    return tuple(joints) if joints else tuple(n for n, kind in known.items() if kind == "revolute")


def _extend_chain(
    chain: Chain, terms: Iterable[tuple[int, Term]], columns: Iterable[ChainColumn], unit: str, prior: float
) -> Chain:
    """The chain with terms by element number, each of a parameter of its own, and computed columns; what is there already stays."""
    elements, names = list(chain.elements), []
    for at, term in terms:
        elements[at] = replace(elements[at], terms=(*elements[at].terms, term))
        names.append(term.parameter)
    return _add(replace(chain, elements=tuple(elements)), names, columns, unit, prior)


def _add(chain: Chain, names: Iterable[str], columns: Iterable[ChainColumn], unit: str, prior: float) -> Chain:
    """The chain with free parameters, zero until something is known, and computed columns; what is there already stays."""
    parameters = tuple(Parameter(name, 0.0, unit, True, prior) for name in names)
    new = tuple(c for c in columns if c not in chain.derived)
    return replace(chain, table=chain.table + parameters, derived=(*chain.derived, *new))


def _drive_term(chain: Chain, joint: str, symbol: str, column: str) -> tuple[int, Term]:
    """The number of the element that a joint moves, and a parameter times a column in it, which counts with the joint's own sign."""
    at = drive(chain, joint)
    own = drive_term(chain.elements[at], joint)
    assert own is not None
    return at, Term(f"{joint}.{symbol}", column, own.factor)


def _add_recorded(chain: Chain, joints: Sequence[str], source: str, symbol: str, unit: str, prior: float) -> Chain:
    """The chain with a parameter of every joint times what was recorded of it."""
    columns = {joint: Recorded(f"{source}.{joint}") for joint in joints}
    terms = [_drive_term(chain, joint, symbol, column.names[0]) for joint, column in columns.items()]
    return _extend_chain(chain, terms, columns.values(), unit, prior)


# --- the groups -----------------------------------------------------------------------------------------------------


def with_gains(chain: Chain, joints: Sequence[str] = (), prior: float = GAIN) -> Chain:
    """Frees the gains of joints (all by default), each with a prior (no unit)."""
    names = {f"{j}.gain" for j in (joints or chain.joint_names)}
    table = chain.table.with_free({*chain.table.free, *names})
    rows = (replace(p, prior=prior) if p.name in names else p for p in table.rows)
    return replace(chain, table=ParameterTable(tuple(rows), table.together))


def with_eccentricity(
    chain: Chain,
    joints: Sequence[str] = (),
    harmonics: Sequence[float] | Mapping[str, Sequence[float]] = (1, 2),
    prior: float = GEAR,
    within: Mapping[str, tuple[float, float]] | None = None,
) -> Chain:
    """Adds cos and sin of multiples of the joint's own angle to turning joints, the same orders for all or some for
    each by name; `prior` in rad. Outside `within` (low, high in rad, by joint) they fade to zero.

    Order 2 x ratio is what a strain-wave gear adds per turn of its motor. What a joint has already stays as it is.
    Raises ModelError for an order that is not above zero.
    """
    each = harmonics if isinstance(harmonics, Mapping) else dict.fromkeys(turning(chain, joints), harmonics)
    _ = turning(chain, tuple(within or ()))
    terms, columns = [], []
    for joint in turning(chain, tuple(each)) if each else ():
        for order in each[joint]:
            if not 0 < order < np.inf:
                expected = "a number above 0"
                raise ModelError("not an order of a harmonic", key="harmonics", found=order, expected=expected)
            wave = Harmonic(joint, float(order), *(within or {}).get(joint, ()))
            # A parameter's name has one dot only.
            symbols = [f"{wave_of}{order:g}".replace(".", "_") for wave_of in ("cos", "sin")]
            if f"{joint}.{symbols[0]}" in chain.table:
                continue
            columns.append(wave)
            terms += [_drive_term(chain, joint, *pair) for pair in zip(symbols, wave.names, strict=True)]
    return _extend_chain(chain, terms, columns, "rad", prior)


def orders_of(chain: Chain) -> dict[str, tuple[float, ...]]:
    """The orders of ripple or eccentricity that each joint has."""
    out: dict[str, tuple[float, ...]] = {}
    for column in chain.derived:
        if isinstance(column, Harmonic):
            out[column.joint] = (*out.get(column.joint, ()), column.order)
    return out


def with_backlash(chain: Chain, joints: Sequence[str] = (), prior: float = GEAR) -> Chain:
    """Adds half the play, times the recorded sign of approach (column `approach.joint`, -1, 0 or 1); `prior` in rad."""
    return _add_recorded(chain, turning(chain, joints), "approach", "backlash", "rad", prior)


def with_compliance(
    chain: Chain,
    joints: Sequence[str] = (),
    loads: Sequence[Load] = (),
    *,
    gravity: Triple = GRAVITY,
    torque: str = "gravity",
    prior: float = SOFT,
) -> Chain:
    """Adds the twist of joints under torque: computed from loads (and the recorded `payload` at the tool), or recorded
    as `torque.joint` (N m) when `torque` is "recorded"; `prior` in rad/(N m).

    Raises ModelError when nothing weighs anything.
    """
    # A measured torque counts with the joint's own sign, a computed one about the element's axis.
    chosen = turning(chain, joints)
    if torque != "gravity":
        return _add_recorded(chain, chosen, "torque", "compliance", COMPLIANCE, prior)
    terms = [(drive(chain, j), Term(f"{j}.compliance", f"gravity.{j}")) for j in chosen]
    return _extend_chain(chain, terms, [_gravity(chain, loads, gravity)], COMPLIANCE, prior)


def with_bending(
    chain: Chain,
    joints: Sequence[str] = (),
    loads: Sequence[Load] = (),
    *,
    gravity: Triple = GRAVITY,
    prior: float = SOFT,
) -> Chain:
    """Adds the bending of bearings and links: right behind each joint, two turns across its axis, each by its
    component of the moment of gravity; `prior` in rad/(N m)."""
    chosen = turning(chain, joints)
    made, names = chain, []
    for joint in chosen:
        at = drive(made, joint)
        (_, u, v), point = axis_of(made.elements[at])
        bends = []
        for symbol, direction in (("u", u), ("v", v)):
            names.append(f"{joint}.bend_{symbol}")
            screw = tuple(float(s) for s in (*np.cross(point, direction), *direction))
            bends.append(Element("screw", (Term(names[-1], f"gravity.{joint}.{symbol}"),), 0.0, screw))
        made = replace(made, elements=(*made.elements[: at + 1], *bends, *made.elements[at + 1 :]))
    return _add(made, names, [_gravity(chain, loads, gravity)], COMPLIANCE, prior)


def _gravity(chain: Chain, loads: Sequence[Load], gravity: Triple) -> Gravity:
    for load in loads:
        if load.link:
            _ = drive(chain, load.link)
    carried = Load("", 1.0, column="payload")
    # One source of moments per model, whichever groups ask for it.
    known = next((c for c in chain.derived if isinstance(c, Gravity)), None)
    model = known.model if known else _bare(chain)
    return Gravity(model, chain.joint_names, (*loads, carried), _direction(gravity))


def _bare(chain: Chain) -> Chain:
    """The chain without what was added beyond geometry: terms of the joints' own columns only."""
    plain = {"1", *chain.joint_names}
    kept = [replace(e, terms=tuple(t for t in e.terms if t.column in plain)) if e.terms else e for e in chain.elements]
    elements = tuple(new for new, old in zip(kept, chain.elements, strict=True) if new.terms or not old.terms)
    return replace(chain, elements=elements, derived=(), groups=())


def _direction(gravity: Triple) -> Triple:
    if not np.isfinite(gravity).all() or not np.any(gravity):
        expected = "such as 0, 0, -9.80665"
        raise ModelError("gravity has no direction", key="gravity", found=list(gravity), expected=expected)
    return gravity


def with_sag(
    chain: Chain, joints: Sequence[str] = (), *, gravity: Triple = GRAVITY, prior: float = 5.0 * SOFT
) -> Chain:
    """Adds the twist of joints under unknown masses: what 1 kg at the end of each link behind it would do, times
    compliance times that mass; `prior` in rad kg/(N m).

    Any mass on the line between two frames' origins is a sum of two such masses, so this is the general gravity torque
    of an arm with slender links.
    """
    chosen = turning(chain, joints)
    model = _bare(chain)
    terms, columns = [], []
    for i, link in enumerate(chain.joint_names):
        own = tuple(j for j in chosen if chain.joint_names.index(j) <= i)
        if own:
            columns.append(Gravity(model, own, (Load(link, 1.0),), _direction(gravity), f"gravity of {link}"))
        terms += [(drive(chain, joint), Term(f"{joint}.sag_{link}", f"gravity of {link}.{joint}")) for joint in own]
    return _extend_chain(chain, terms, columns, SAG, prior)


def with_expansion(chain: Chain, reference: float = 293.15, *, per_joint: bool = False, prior: float = GROWTH) -> Chain:
    """Adds thermal growth of every length of the joints' rows, times (temperature - reference) in K; `prior` in 1/K.

    Raises ModelError for conventions that place axes in base coordinates: they hold no lengths of links.
    """
    elements: list[Element] = []
    columns: list[ChainColumn] = []
    owners: list[str] = []
    owner = "base"
    for i, element in enumerate(chain.elements):
        # A constant transform belongs to the row before it.
        owner = element.terms[0].parameter.rpartition(".")[0] if element.terms else owner
        name = f"{owner}.expansion" if per_joint else "thermal.expansion"
        spans: list[tuple[str, tuple[Term, ...], float]] = []
        if owner not in ("base", "tool", "home") and element.axis == "frame":
            spans = [(f"t{x}", (t,), 0.0) for x, t in zip("xyz", element.terms[:3], strict=True)]
        elif owner not in ("base", "tool", "home") and element.axis in ("tx", "ty", "tz"):
            spans = [(element.axis, tuple(t for t in element.terms if t.column == "1"), element.constant)]
        for axis, terms, constant in spans:
            factors = tuple((t.parameter, t.factor) for t in terms)
            made = Growth(f"{owner}.{axis[1]}{i}", 0.0, reference, factors, constant)
            columns.append(made.at(chain.table))
            owners.append(name)
            elements.append(Element(axis, (Term(name, made.names[0]),)))
        elements.append(element)
    if not owners:
        raise ModelError(
            "thermal growth needs the lengths of the links", key="expansion", found=chain.convention,
            expected="a convention with lengths, such as dh or urdf",
        )  # fmt: skip
    return _add(replace(chain, elements=tuple(elements)), dict.fromkeys(owners), columns, "1/K", prior)
