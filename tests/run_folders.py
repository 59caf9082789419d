"""Run folders of earlier versions, and what stands in a folder."""

from __future__ import annotations

import json
from pathlib import Path


def earlier(folder: Path) -> Path:
    """The same run as an earlier version would have written it: nothing says what its files were."""
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    del result["files"]
    (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")
    return folder


def content(folder: Path) -> dict[str, bytes]:
    """Every file by name."""
    return {p.name: p.read_bytes() for p in sorted(folder.iterdir()) if p.is_file()}
