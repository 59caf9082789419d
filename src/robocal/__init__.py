"""robocal finds out what a robot really is: true parameters from measurements, with honest uncertainty.

Importing this package is cheap on purpose: numpy, scipy and numba are loaded by the rooms that need them.
"""

__all__ = ["__version__"]

__version__ = "0.1.0"
