"""python -m robocal."""

import sys

from robocal.cli import main

if __name__ == "__main__":
    sys.exit(main())
