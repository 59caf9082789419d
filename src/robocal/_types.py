"""Types of arrays, by what their elements are; shapes stand in the docstring of whoever takes or gives one."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "Bools", "Ints"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
