"""The verdict on unseen errors alone: no machine, no data, no fit."""

from __future__ import annotations

from dataclasses import dataclass

from robocal.diagnose.check_registry import Context
from robocal.prove.evidence import Evidence
from robocal.prove.verdict import verdict_of


@dataclass(frozen=True)
class Errors(Context):
    evidence: Evidence | None = None
    frames_alone: bool = False
    silent: tuple[str, ...] = ()

    @property
    def gain(self):
        return self.evidence.gain

    @property
    def improvement(self):
        return self.gain.proven


def judge(before, after, constant, configurations, **more):
    return verdict_of(
        Errors(None, evidence=Evidence(before, after, constant, configurations, **more)), over_range=False
    )
