"""How much of what tells a frame has to be there at the nominal robot; `diagnose.limits` says why."""

__all__ = ["FRAME_NEVER_TURNED", "FRAME_TURNED"]

FRAME_NEVER_TURNED = 4e-3
FRAME_TURNED = 0.5
