"""`python -m benchmarks` is `python benchmarks/run.py`: the scripts here import each other as neighbours, not as a
package.
"""

import runpy
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
runpy.run_path(str(HERE / "run.py"), run_name="__main__")
