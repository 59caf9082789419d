"""What a run folder keeps so that its result can be trusted later: how far the parameters may be off, and the map of the
workspace."""

from __future__ import annotations

import math
from typing import Any

from robocal.apply.accuracy import accuracy_map
from robocal.errors import ModelError
from robocal.files.accuracy_map import accuracy_columns, accuracy_text
from robocal.files.covariance import COVARIANCE, Knowledge, covariance_text
from robocal.files.runfolder import ACCURACY
from robocal.fit.estimators import estimator
from robocal.measure.machine import Model, freedom_of
from robocal.parameters import FRAME_SYMBOLS
from robocal.prove.identification import Identification

__all__ = ["knowledge", "knowledge_files", "map_columns"]

ABOARD = ("lengths", "swivel", "load", "inclination")  # kinds that say nothing of where the base is


def knowledge(found: Identification[Model]) -> Knowledge:
    """What an identification knows of its parameters."""
    assert found.total is not None
    by_name = {p.name: p for p in found.parameters}
    values = {n: by_name[n].identified for n in found.total.names}
    nominal = {n: by_name[n].nominal for n in found.total.names}
    # The first instrument of a unit speaks for new measurements in it.
    noise = {g.unit: g.sigma for g in reversed(found.groups) if math.isfinite(g.sigma)}
    known = _base_is_known(found)
    return Knowledge(found.total, values, nominal, found.joints, found.conditions, noise, known, found.whitened_rows)


def _base_is_known(found: Identification[Model]) -> bool:
    """Whether an instrument stood still on the base: no frame was free, and of a platform on cables one of the instruments is no part
    of the robot."""
    assert found.total is not None
    if not freedom_of(found.nominal):
        return all(n in found.nominal.table for n in found.total.names)
    frames = [n for n in found.total.names if n not in found.nominal.table and n.rpartition(".")[2] in FRAME_SYMBOLS]
    return not frames and any(g.kind not in ABOARD for g in found.groups)


def map_columns(found: Identification[Model]) -> dict[str, list[Any]]:
    """The columns of accuracy_map.csv; none for a method that knows no errors, or where the model asks for columns that
    nobody recorded."""
    if found.total is None or found.baseline is None or estimator(found.options.method).blind:
        return {}
    moving, corrected = found.nominal.mechanism, found.corrected.mechanism
    if moving is None or corrected is None or moving.freedom is not None:
        return {}  # joint values do not say where it is
    before = {n: found.baseline[n].value for n in found.nominal.table.names if n in found.baseline}
    try:
        made = accuracy_map(moving.with_values(before), corrected, found.total, found.conditions, found.joints)
    except ModelError:
        return {}
    return accuracy_columns(made)


def knowledge_files(found: Identification[Model], cells: dict[str, list[Any]]) -> dict[str, str]:
    """The texts by file name; a method that knows no errors has none."""
    if found.total is None or estimator(found.options.method).blind:
        return {}
    units = {p.name: p.unit for p in found.parameters}
    return {COVARIANCE: covariance_text(knowledge(found), units)} | ({ACCURACY: accuracy_text(cells)} if cells else {})
