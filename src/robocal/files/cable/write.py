"""A cable robot with identified numbers, back into its file: only numbers change, every other byte stays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from robocal.errors import ModelError
from robocal.files.cable.cablefile import CableFile
from robocal.files.cable.show import describe_cable
from robocal.files.units import same
from robocal.files.yamlio import Path_, edit, path_text, stamped

__all__ = ["render_cable"]


def render_cable(file: CableFile, values: Mapping[str, float]) -> tuple[str, tuple[str, ...]]:
    """The robot with other parameter values (SI, by name) as text, and the names that the file cannot hold. A file of another format
    is written as robot.yaml. Raises ModelError for an unknown name and for one anchor that two cables share and that is to be at two
    places."""
    changed = {n: float(v) for n, v in values.items() if not same(file.robot.table[n].value, float(v))}
    if file.places is None:
        after = replace(file.robot, table=file.robot.table.with_values(changed))
        return describe_cable(after, file.units), ()
    left_out = tuple(n for n in changed if n not in file.places)
    after_values = {n: changed.get(n, file.robot.table[n].value) for n in file.robot.table.names}
    out: dict[Path_, float | str] = {}
    owner: dict[Path_, str] = {}
    for name, (path, unit) in file.places.items():
        if name not in after_values:
            continue  # another cable's, who shares its anchor
        first = owner.setdefault(path, name)
        if first != name and not same(after_values[first], after_values[name]):
            raise ModelError(
                f"{first} and {name} are one anchor in the file and cannot be at two places",
                file=file.path,
                key=path_text(path),
                expected="an anchor of its own for every cable",
            )
        if name in changed:
            out[path] = unit.from_si(changed[name])
    text = edit(file.text, out, file.path)
    origin = file.path.name if file.path else file.robot.name
    return stamped(text, origin, len(changed) - len(left_out)), left_out
