"""Everything that robocal may remark on, by name; the names stand in result.json and do not change. Each stands beside its
sentence in `english`."""

from __future__ import annotations

from robocal.remarks.english import Code

__all__ = ["Code"]
