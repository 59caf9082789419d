"""Draws, photographs, detects and identifies: python examples/arm-eye-in-hand/make.py FOLDER. Nothing here was measured.

The rig is the case `hand` of `scripts/small_arm.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))

from small_arm import run

if __name__ == "__main__":
    run("hand", Path(sys.argv[1]))
