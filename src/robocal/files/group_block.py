"""The `groups:` of a robot.yaml: what the robot does beyond geometry, with the values that were identified.

    groups:
      eccentricity: {harmonics: [1, 2], prior: 0.02, values: {j1.cos1: 0.004}}
      compliance: {gravity: [0, 0, -9.81], links: [{joint: j2, mass: 12.7, com: [380, 0, 158]}]}
      expansion: {reference: 20 degC}

Priors and values are in the file's units (what is per kelvin or per newton metre stays so), masses in kg.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from pydantic import Field, FiniteFloat

from robocal.arms.chain import Chain, Group
from robocal.arms.gravity_load import Load
from robocal.arms.groups import GROUPS, add, rule_of
from robocal.errors import ModelError, nearest
from robocal.files.schema import FileModel, Triple, validate
from robocal.files.units import UNITS, Units, number, parse_unit
from robocal.files.yamlio import Path_, YamlDocument, path_text

__all__ = ["add_groups", "group_changes", "group_lines", "parse_options", "plain_options", "read_groups"]

Harmonics = list[FiniteFloat] | dict[str, list[FiniteFloat]]


class LinkModel(FileModel):
    """The mass of one link, its centre in the frame in which the link's row ends; without a joint, at the tool."""

    joint: str = ""
    mass: FiniteFloat
    com: Triple = Field(default_factory=lambda: [0.0, 0.0, 0.0])


class GroupModel(FileModel):
    """One group; which of these it takes is said by its rule."""

    joints: list[str] | None = None
    prior: FiniteFloat | None = None
    values: dict[str, FiniteFloat] = Field(default_factory=dict)
    harmonics: Harmonics | None = None
    range: dict[str, list[FiniteFloat]] | None = None
    highest: int | None = Field(default=None, ge=1, le=1000)
    gravity: Triple | None = None
    links: list[LinkModel] | None = None
    torque: Literal["gravity", "recorded"] | None = None
    payload_only: bool | None = None
    reference: FiniteFloat | str | None = None
    per_joint: bool | None = None


def read_groups(chain: Chain, document: YamlDocument, units: Units) -> Chain:
    """The chain with the groups that a robot.yaml states under `groups:`, at their values. Raises FormatError."""
    stated = document.data["groups"]
    mapping = isinstance(stated, dict)
    document.insist(mapping, "not a mapping", ("groups",), found=stated, expected="{eccentricity: {...}, ...}")
    for name, given in stated.items():
        at: Path_ = ("groups", name)
        document.insist_known(name, GROUPS, "unknown group", at)
        model = validate(GroupModel, document, {} if given is None else given, at)
        prior, path = model.prior, (*at, "prior")
        good, expected = prior is None or prior > 0, "a number above 0"
        document.insist(good, "a prior is a standard deviation", path, found=prior, expected=expected)
        for i, link in enumerate(model.links or ()):
            mass, path = link.mass, (*at, "links", i, "mass")
            document.insist(mass > 0, "a mass is above 0", path, found=mass, expected="kg")
        try:
            chain = add(chain, name, _options(name, model, units, document, at))
            chain = _set_values(chain, chain.groups[-1], model.values, units, document, at)
        except ModelError as error:
            key = str(error.key or "").removeprefix("groups.").removeprefix(f"{name}.")
            where = (*at, key) if key in (given or {}) else at
            place = {"row": document.row(where), "key": path_text(where), "found": error.found or error.key}
            raise error.of_file(document.path, **place) from None
    return chain


def _options(name: str, model: GroupModel, units: Units, document: YamlDocument, at: Path_) -> dict[str, Any]:
    """What was stated, in SI."""
    out = parse_options(model.model_dump(exclude={"values"}, exclude_none=True))
    if "prior" in out:
        out["prior"] = units.of(rule_of(name).unit).to_si(out["prior"])
    if "links" in out:
        out["links"] = tuple(replace(m, at=tuple(units.length.to_si(v) for v in m.at)) for m in out["links"])
    if model.reference is not None:
        out["reference"] = _temperature(model.reference, document, (*at, "reference"))
    for joint, given in (model.range or {}).items():
        ordered = len(given) == 2 and given[0] < given[1]
        document.insist(ordered, "not a range", (*at, "range", joint), found=given, expected="[lower, upper]")
        out["range"][joint] = tuple(units.angle.to_si(v) for v in given)
    return out


def _temperature(given: float | str, document: YamlDocument, at: Path_) -> float:
    """A temperature in K: a number is in degC, a text names its unit."""
    words = str(given).split()
    try:
        value = float(words[0])
    except (ValueError, IndexError):
        document.fail("not a temperature", at, found=given, expected="such as 20 degC")
    unit = parse_unit(words[1], "K", file=document.path, row=document.row(at)) if len(words) > 1 else UNITS["degC"]
    return unit.to_si(value)


def _set_values(
    chain: Chain, group: Group, values: Mapping[str, float], units: Units, document: YamlDocument, at: Path_
) -> Chain:
    si = {}
    for name, value in values.items():
        if name not in group.parameters:
            near = nearest(name, group.parameters)
            document.fail("no parameter of this group", (*at, "values", name), found=name, suggestion=near)
        si[name] = units.of(chain.table[name].unit).to_si(value)
    return chain.with_values(si)


# --- writing --------------------------------------------------------------------------------------------------------


def _flow(value: Any, units: Units) -> str:
    if isinstance(value, Load):
        parts = {"joint": value.link, "mass": value.mass, "com": [units.length.from_si(v) for v in value.at]}
        return _flow({k: v for k, v in parts.items() if v != ""}, units)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k}: {_flow(v, units)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_flow(v, units) for v in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return number(value) if isinstance(value, int | float) else str(value)


def _group_document(chain: Chain, group: Group, units: Units) -> dict[str, Any]:
    """A group as a file states it, in the file's units."""
    out = dict(group.options)
    if "prior" in out:
        out["prior"] = units.of(rule_of(group.name).unit).from_si(out["prior"])
    if "range" in out:
        out["range"] = {j: [units.angle.from_si(v) for v in pair] for j, pair in out["range"].items()}
    if "reference" in out:
        out["reference"] = f"{number(out['reference'])} K"
    values = _values(chain, group, units)
    return out | ({"values": values} if values else {})


def _values(chain: Chain, group: Group, units: Units) -> dict[str, float]:
    """What was identified; a gain stands in its joint's row."""
    table = chain.table
    names = [n for n in group.parameters if not n.endswith(".gain") and table[n].value != 0.0]
    return {n: units.of(table[n].unit).from_si(table[n].value) for n in names}


def group_lines(chain: Chain, units: Units) -> list[str]:
    """The lines of `groups:` for a new robot.yaml, of a chain that has some."""
    return ["groups:", *(f"  {g.name}: {_flow(_group_document(chain, g, units), units)}" for g in chain.groups)]


def group_changes(document: YamlDocument, chain: Chain, units: Units) -> dict[Path_, float | str]:
    """What has to be written into a robot.yaml so that it states the groups of a chain."""
    stated = document.data.get("groups")
    out: dict[Path_, float | str] = {}
    if not isinstance(stated, dict):
        if chain.groups:
            out["groups",] = "\n" + "\n".join(group_lines(chain, units)[1:])
        return out
    for group in chain.groups:
        at: Path_ = ("groups", group.name)
        if not isinstance(stated.get(group.name), dict):
            out[at] = _flow(_group_document(chain, group, units), units)
            continue
        given = stated[group.name]
        shown = _group_document(chain, group, units)
        out.update({(*at, k): _flow(shown[k], units) for k in ("harmonics", "range") if k in shown and k not in given})
        values = _values(chain, group, units)
        if isinstance(given.get("values"), dict) and given["values"]:
            zero = {n: 0.0 for n in given["values"] if n not in values}
            out.update({(*at, "values", n): v for n, v in (values | zero).items()})
        elif values:
            out[(*at, "values")] = _flow(values, units)
    return out


def plain_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Options as JSON holds them, in SI."""
    out = dict(options)
    if "links" in out:
        out["links"] = [{"joint": m.link, "mass": m.mass, "com": list(m.at)} for m in out["links"]]
    return out


def parse_options(plain: Mapping[str, Any]) -> dict[str, Any]:
    """The inverse of `plain_options`."""
    out: dict[str, Any] = {k: tuple(v) if isinstance(v, list | tuple) else v for k, v in plain.items()}
    if "links" in out:
        out["links"] = tuple(Load(m["joint"], m["mass"], tuple(m["com"])) for m in out["links"])
    for key in ("harmonics", "range"):
        if isinstance(out.get(key), Mapping):
            out[key] = {j: tuple(v) for j, v in out[key].items()}
    return out


def add_groups(chain: Chain, groups: Sequence[tuple[str, Mapping[str, Any]]]) -> Chain:
    """A chain with groups as a result states them."""
    for name, options in groups:
        if not any(g.name == name for g in chain.groups):
            chain = add(chain, name, parse_options(options))
    return chain
