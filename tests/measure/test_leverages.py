"""What each group of sensors pays for blocks and shared columns is the same by sums as row by row."""

from __future__ import annotations

import numpy as np
import pytest
from scenarios import ARMS, BLOCKS

from robocal.estimate.leverage import _row_by_row, leverages
