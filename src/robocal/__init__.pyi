from robocal._version import __version__ as __version__
from robocal.front import Arm as Arm
from robocal.front import Identified as Identified
from robocal.front import Measurements as Measurements
from robocal.front import identify as identify
from robocal.front import measurements as measurements
from robocal.front import robot as robot

__all__ = ["Arm", "Identified", "Measurements", "__version__", "identify", "measurements", "robot"]
