from robocal._version import __version__ as __version__
from robocal.jobs.front import Arm as Arm
from robocal.jobs.front import Identified as Identified
from robocal.jobs.front import Measurements as Measurements
from robocal.jobs.front import identify as identify
from robocal.jobs.front import measurements as measurements
from robocal.jobs.front import robot as robot

__all__ = ["Arm", "Identified", "Measurements", "__version__", "identify", "measurements", "robot"]
