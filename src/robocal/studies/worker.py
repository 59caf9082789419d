"""Processes that work on chunks, one question and one answer at a time.

Own processes, not those of `multiprocessing`, which would run the script of whoever calls again in each of them. They look for modules
where whoever calls does: a file of the folder that they start in, such as a `numba.py`, is none of their affair.
"""

from __future__ import annotations

import contextlib
import gc
import os
import pickle
import subprocess
import sys
from typing import IO, Any

from robocal.studies.work import Work, do

__all__ = ["Died", "Worker", "serve"]

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
BEGIN = "import sys; sys.path[:] = sys.argv[1:]; from robocal.studies.worker import serve; serve()"
SIZE = 8  # bytes that say how long what follows is
RARELY = 50_000  # objects from one search for garbage to the next: trials leave little that nobody else clears away


class Died(Exception):
    """The process ended while it worked."""


class Worker:
    """A process of one thread. An interrupt from the keyboard is not its affair: it ends when no request comes any more."""

    def __init__(self) -> None:
        env = {**os.environ, **dict.fromkeys(THREADS, "1")}
        command, pipe = [sys.executable, "-P", "-c", BEGIN, *sys.path], subprocess.PIPE
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, env=env, start_new_session=True)

    def ask(self, work: Work) -> None:
        """Has a chunk done. Raises Died where the process ended, and whatever the trials raised."""
        assert self.process.stdin is not None and self.process.stdout is not None
        try:
            _send(self.process.stdin, work)
            error = _receive(self.process.stdout)
        except (OSError, EOFError):
            raise Died from None
        if error is not None:
            raise error

    def end(self) -> None:
        """Lets the process go, whatever it is at: a chunk is written whole or not at all."""
        for stream in (self.process.stdin, self.process.stdout):
            with contextlib.suppress(OSError):
                if stream is not None:
                    stream.close()
        self.process.kill()
        self.process.wait()


def _send(stream: IO[bytes], value: Any) -> None:
    content = pickle.dumps(value)
    stream.write(len(content).to_bytes(SIZE, "big") + content)
    stream.flush()


def _receive(stream: IO[bytes]) -> Any:
    """Raises EOFError where the other side is gone."""
    head = stream.read(SIZE)
    content = stream.read(int.from_bytes(head, "big")) if len(head) == SIZE else b""
    if len(head) < SIZE or len(content) < int.from_bytes(head, "big"):
        raise EOFError
    return pickle.loads(content)


def serve() -> None:
    """Works until no request comes, or no reader is left."""
    questions, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever prints does not speak between the lines
    gc.set_threshold(RARELY, *gc.get_threshold()[1:])
    with contextlib.suppress(BrokenPipeError, EOFError):
        while True:
            work = _receive(questions)
            try:
                do(work)
                if not gc.get_freeze_count():
                    gc.freeze()  # what one chunk needed the next one needs: it is not looked through for garbage again and again
                _send(answers, None)
            except Exception as error:
                _send(answers, error)
