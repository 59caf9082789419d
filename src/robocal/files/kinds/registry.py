"""The readers that exist, by the name of their kind."""

from __future__ import annotations

from typing import Any, cast

from robocal.files.kinds.base import KindReader
from robocal.files.kinds.pose import PoseModel, read_pose
from robocal.files.kinds.position import PositionModel, read_position

__all__ = ["READERS"]

READERS: dict[str, KindReader] = {
    reader.name: reader
    for reader in (
        KindReader("position", PositionModel, cast(Any, read_position), (True, True, True, False, False, False)),
        KindReader("pose", PoseModel, cast(Any, read_pose)),
    )
}
