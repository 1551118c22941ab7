#!/usr/bin/env python3
"""libigl's as-rigid-as-possible deformation and cotangent matrix.

igl_arap.py JOB RUNS ITERATIONS

Prints one line of JSON; times are [wall, processor] medians in seconds.
Exit code 3: libigl is not installed.
"""
import json
import os
import resource
import statistics
import sys
import time

for variable in ("OMP_NUM_THREADS", "OMP_THREAD_LIMIT", "IGL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # libraries read them when imported

try:
    import igl
    import numpy as np
except ImportError as error:
    print(error, file=sys.stderr)
    sys.exit(3)


def read_job(path):
    with open(path, "rb") as file:
        num_points, num_faces, num_handles = np.fromfile(file, np.uint64, 3)
        points = np.fromfile(file, float, 3 * int(num_points)).reshape(-1, 3)
        faces = np.fromfile(file, np.uint32, 3 * int(num_faces)).reshape(-1, 3).astype(np.int64)
        handles = np.fromfile(file, np.uint32, int(num_handles)).astype(np.int32)
        targets = np.fromfile(file, float, 3 * int(num_handles)).reshape(-1, 3)
    return points, faces, handles, targets


class Phases:
    def __init__(self):
        self.runs = {}

    def time(self, name, call):
        wall, cpu = time.perf_counter(), time.process_time()
        result = call()
        self.runs.setdefault(name, []).append((time.perf_counter() - wall, time.process_time() - cpu))
        return result

    def medians(self):
        return {name: [statistics.median(column) for column in zip(*runs)] for name, runs in self.runs.items()}


def main():
    path, runs, iterations = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    points, faces, handles, targets = read_job(path)
    phases = Phases()
    for _ in range(runs):
        phases.time("cotmatrix", lambda: igl.cotmatrix(points, faces))
        # The spokes energy of the ARAP paper, which is also the faster one.
        data = igl.ARAPData()
        data.energy = igl.ARAPEnergyType.ARAP_ENERGY_TYPE_SPOKES
        data.max_iter = iterations
        phases.time("preprocess", lambda: igl.arap_precomputation(points, faces, 3, handles, data))
        phases.time("iterations", lambda: igl.arap_solve(targets, data, points))
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    line = {"peer": "libigl ARAP", "n": len(points), "num_iterations": iterations, "megabytes": megabytes}
    print(json.dumps(line | phases.medians()))


main()
