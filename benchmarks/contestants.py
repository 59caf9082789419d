"""Who takes part, and the driver's end of the protocol (see `protocol.py`)."""

import json
import os
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path

from environments import Unavailable, ensure

HERE = Path(__file__).resolve().parent
LOGS = HERE / ".cache" / "logs"
ANSWER_LIMIT = 600  # seconds for one answer, compilation included
# one thread for everybody: 168 x 19 numbers gain nothing from more, and idle BLAS threads disturb the neighbours
THREADS = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)


@dataclass(frozen=True)
class Contestant:
    """A row of the table: a worker script, its arguments, and the environment that it runs in (None: the main one)."""

    name: str
    environment: str | None
    script: str
    arguments: tuple[str, ...] = ()


CONTESTANTS = (
    Contestant("robocal", None, "robocal_worker.py"),
    Contestant("pyceres, pose by pose, compiled", "pyceres", "peers/worker_pyceres.py", ("pose", "compiled")),
    Contestant("pyceres, all at once, compiled", "pyceres", "peers/worker_pyceres.py", ("all", "compiled")),
    Contestant("pyceres, all at once, numpy", "pyceres", "peers/worker_pyceres.py", ("all", "numpy")),
    Contestant("scipy lm, compiled", "scipy", "peers/worker_scipy.py", ("lm", "compiled")),
    Contestant("scipy trf, compiled", "scipy", "peers/worker_scipy.py", ("trf", "compiled")),
    Contestant("scipy lm, numpy", "scipy", "peers/worker_scipy.py", ("lm", "numpy")),
    Contestant("pybotics, documented", "pybotics", "peers/worker_pybotics.py", ("documented",)),
    Contestant("pybotics, xyz residuals", "pybotics", "peers/worker_pybotics.py", ("xyz",)),
    Contestant("FIGAROH, its own choice", "figaroh", "peers/worker_figaroh.py", ("own",)),
    Contestant("FIGAROH, the same 19", "figaroh", "peers/worker_figaroh.py", ("same",)),
)


class Worker:
    """A running contestant. Raises `Unavailable` when it cannot start or stops answering."""

    def __init__(self, contestant: Contestant):
        self.contestant = contestant
        script = HERE / contestant.script
        if not script.exists():
            raise Unavailable(f"{contestant.script} does not exist")
        python = sys.executable if contestant.environment is None else str(ensure(contestant.environment))
        LOGS.mkdir(parents=True, exist_ok=True)
        self._log = LOGS / f"{script.stem}-{'-'.join(contestant.arguments) or 'main'}.log"
        env = os.environ | THREADS | {"PYTHONPATH": str(HERE), "MPLBACKEND": "Agg"}
        with self._log.open("w") as log:
            self._process = subprocess.Popen(
                [python, str(script), *contestant.arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                env=env,
            )
        hello = self._read()
        if not hello.get("ready"):
            raise Unavailable(hello.get("unavailable", "it did not say that it is ready"))
        self.how: str = hello["how"]
        self.versions: dict[str, str] = hello["versions"]

    def _read(self) -> dict:
        """The next line, or the last line of the log as the reason why there is none."""
        timer = threading.Timer(ANSWER_LIMIT, self._process.kill)
        timer.start()
        try:
            line = self._process.stdout.readline()
        finally:
            timer.cancel()
        if line:
            return json.loads(line)
        self._process.wait()
        said = self._log.read_text().strip().splitlines()
        raise Unavailable(f"it stopped: {said[-1] if said else 'without a word'}".replace(str(HERE), "benchmarks"))

    def ask(self, job: Path, repeat: int) -> dict:
        """Solve a job `repeat` times."""
        try:
            self._process.stdin.write(json.dumps({"job": str(job), "repeat": repeat}) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise Unavailable("it stopped between two jobs") from None
        answer = self._read()
        if "error" in answer:
            raise Unavailable(answer["error"])
        return answer

    def close(self) -> None:
        """Say quit and wait."""
        try:
            self._process.stdin.write('{"quit": true}\n')
            self._process.stdin.close()
            self._process.wait(timeout=10)
        except (OSError, ValueError, subprocess.TimeoutExpired):
            self._process.kill()
            self._process.wait()
