"""How the driver and a contestant talk: JSON lines over stdin and stdout, one long-lived process per contestant.

contestant, once, when it is ready   {"ready": true, "how": "one line on the method", "versions": {"numpy": "2.4.6"}}
                       or, and exits {"unavailable": "why"}
driver      {"job": "path.npz", "repeat": 5}
contestant  {"seconds": [5 floats], "cpu_seconds": [5 floats], "prepare_seconds": 0.1, "iterations": 4, and either
             "parameters": [23 floats, the full vector in the job's order], or
             "held_out": [[x, y, z], ... 500 predicted held-out positions in metres]}
                         or, if it failed {"error": "text"}
driver      {"quit": true}, or end of file

The job file holds names, nominal, free, expected, limits, sigma, q, positions, held_out_q (see `job.Job.save`), in
metres and radians; the truth stays with the driver, which computes the held-out error of all contestants in the same
way.

A contestant is a function `prepare(job) -> (solve, answer)`. `prepare` is not timed and builds what a user would hold
in memory already: arrays, a robot model; it is called once per job file and process. `solve()` starts from the
nominal values each time and is what is timed. `answer(result)` makes the dictionary above from the last result
(without the two timings). Before the first timed solve of a process there is one untimed solve (compilation, caches).
"""

import gc
import json
import os
import sys
import time
import traceback
from importlib.metadata import version
from types import SimpleNamespace

import numpy as np


def load(path) -> SimpleNamespace:
    """The job file as a namespace of arrays; a single number becomes a float or an int, names a list of str."""
    with np.load(path, allow_pickle=False) as data:
        entries = {key: data[key] for key in data.files}
    return SimpleNamespace(
        **{key: v.tolist() if v.ndim == 0 or v.dtype.kind == "U" else v for key, v in entries.items()}
    )


def full_vector(job, free_values) -> list[float]:
    """The 23 values from the 19 free ones."""
    x = job.nominal.copy()
    x[job.free] = free_values
    return x.tolist()


def _timed(solve, repeat):
    """Wall and CPU seconds of each solve and the last result; the garbage collector rests meanwhile, as in `timeit`."""
    seconds, cpu, result = [], [], None
    gc.collect()
    gc.disable()
    try:
        for _ in range(repeat):
            start, busy = time.perf_counter(), time.process_time()
            result = solve()
            seconds.append(time.perf_counter() - start)
            cpu.append(time.process_time() - busy)
    finally:
        gc.enable()
    return seconds, cpu, result


def _private_stdout():
    """The real stdout for the protocol alone; what a library prints goes to stderr instead."""
    out = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    return out


def serve(prepare, how: str, packages=("numpy",)) -> None:
    """Run a contestant until the driver says quit."""
    out = _private_stdout()

    def say(message):
        out.write(json.dumps(message) + "\n")
        out.flush()

    say({"ready": True, "how": how, "versions": {name: version(name) for name in packages}})
    prepared = {}
    warm = False
    for line in sys.stdin:
        request = json.loads(line)
        if request.get("quit"):
            return
        try:
            path = request["job"]
            if path not in prepared:
                job = load(path)
                start = time.perf_counter()
                solve, answer = prepare(job)
                prepared[path] = solve, answer, time.perf_counter() - start
            solve, answer, prepare_seconds = prepared[path]
            if not warm:
                solve()
                warm = True
            seconds, cpu, result = _timed(solve, int(request.get("repeat", 1)))
            say({"seconds": seconds, "cpu_seconds": cpu, "prepare_seconds": prepare_seconds} | answer(result))
        except Exception as error:
            traceback.print_exc()
            say({"error": f"{type(error).__name__}: {error}"})
