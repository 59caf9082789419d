"""Simulates every file in this folder anew: python examples/cable-camera/make.py

The rig is that of rig.yaml, drawn as `scripts/thesis_rig.py` draws the rig of a thesis. Nothing here was measured.
"""

from __future__ import annotations

import sys
from pathlib import Path

from ruamel.yaml import YAML

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1] / "scripts"))

from thesis_rig import draw, write  # noqa: E402

SEED = 3

if __name__ == "__main__":
    said = YAML(typ="safe").load((HERE / "rig.yaml").read_text(encoding="utf-8"))
    # k1 as calibrated is wrong by 0.015, and its sigma says that it may be.
    rig, rng, camera = draw(said, SEED, "dome15")
    write(said, HERE, rig, rng, camera, "dome15")
