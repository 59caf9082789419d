"""python -m robocal."""

import sys

from robocal.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
