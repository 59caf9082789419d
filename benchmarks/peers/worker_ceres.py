"""Ceres in C++ on the joint jobs (`ceres_joint.cc`). Arguments: markers or poses (which are eliminated), dense or sparse."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from ceres_build import libraries, program
from environments import Unavailable
from protocol import load

KINDS = {"none": 0, "huber": 1, "tukey": 3}


def binary(job, path):
    """The job as plain numbers: lists, each after its length."""
    cables = np.column_stack([job.anchors, np.zeros(8)])
    root = np.linalg.inv(np.linalg.cholesky(job.eye_covariance))
    more = [job.corner, job.sigma, job.tuning, KINDS[job.loss]]
    lists = (
        job.views, job.markers, job.eye, job.lens[:8], cables, job.platform, job.view, job.marker, job.uv, job.length, job.corners,
        root, job.lens_prior, more,
    )  # fmt: skip
    with path.open("wb") as out:
        for values in lists:
            flat = np.ascontiguousarray(values, dtype=np.float64).ravel()
            out.write(np.int64(len(flat)).tobytes() + flat.tobytes())


def main():
    first, solver = sys.argv[1:]
    try:
        made, how = program()
    except Unavailable as why:
        print(json.dumps({"unavailable": str(why)}), flush=True)
        return
    print(json.dumps({"ready": True, "how": f"{how}, {first} first, {solver} Schur", "versions": {}}), flush=True)
    files, env = {}, os.environ | {"LD_LIBRARY_PATH": libraries()}
    with tempfile.TemporaryDirectory() as folder:
        for line in sys.stdin:
            request = json.loads(line)
            if request.get("quit"):
                return
            path = request["job"]
            if path not in files:
                files[path] = Path(folder) / f"{len(files)}.bin"
                binary(load(path), files[path])
            words = [str(made), str(files[path]), first, solver, str(request["repeat"])]
            done = subprocess.run(words, capture_output=True, text=True, check=False, env=env)
            failed = {"error": (done.stderr.strip().splitlines() or ["no word"])[-1]}
            answer = failed if done.returncode else json.loads(done.stdout)
            print(json.dumps(answer | {"prepare_seconds": 0.0}), flush=True)


main()
