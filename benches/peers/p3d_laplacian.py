#!/usr/bin/env python3
"""The cotangent matrix of potpourri3d (geometry-central).

p3d_laplacian.py JOB RUNS

Prints one line of JSON; times are [wall, processor] medians in seconds.
Exit code 3: potpourri3d is not installed.
"""
import json
import statistics
import sys
import time

try:
    import numpy as np
    import potpourri3d
except ImportError as error:
    print(error, file=sys.stderr)
    sys.exit(3)

with open(sys.argv[1], "rb") as file:
    num_points, num_faces, _ = (int(x) for x in np.fromfile(file, np.uint64, 3))
    points = np.fromfile(file, float, 3 * num_points).reshape(-1, 3)
    faces = np.fromfile(file, np.uint32, 3 * num_faces).reshape(-1, 3).astype(np.int64)

runs = []
for _ in range(int(sys.argv[2])):
    wall, cpu = time.perf_counter(), time.process_time()
    potpourri3d.cotan_laplacian(points, faces)
    runs.append((time.perf_counter() - wall, time.process_time() - cpu))
medians = [statistics.median(column) for column in zip(*runs)]
print(json.dumps({"peer": "potpourri3d", "n": num_points, "cotmatrix": medians}))
