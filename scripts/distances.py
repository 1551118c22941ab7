#!/usr/bin/env python3
"""Compares geodesic distances with those of potpourri3d (pip install potpourri3d).

    cargo run --release -p cotan-tests --example distance_table -- --save FOLDER
    scripts/distances.py FOLDER

Prints for each mesh the root mean square of the difference, relative to that of the distance, for
both libraries with the same time of heat (4 squared mean edge lengths), and for potpourri3d with
its own default of 1. Prints "skipped" without potpourri3d.
"""

import pathlib
import sys

try:
    import numpy as np
    import potpourri3d
except ImportError:
    print("skipped: potpourri3d is not installed")
    sys.exit(0)


def read(path):
    vertices, faces, distances = [], [], []
    for line in path.read_text().splitlines():
        kind, *numbers = line.split()
        if kind == "v":
            vertices.append([float(x) for x in numbers[:3]])
            distances.append(float(numbers[3]))
        else:
            faces.append([int(x) for x in numbers])
    return np.array(vertices), np.array(faces), np.array(distances)


def difference(ours, theirs):
    reached = np.isfinite(ours)
    ours, theirs = ours[reached], theirs[reached]
    return np.sqrt(np.mean((ours - theirs) ** 2) / np.mean(ours**2))


if len(sys.argv) != 2:
    sys.exit(__doc__)
print("| mesh | same time | its default |")
print("|---|---|---|")
for path in sorted(pathlib.Path(sys.argv[1]).glob("*.txt")):
    vertices, faces, ours = read(path)
    row = []
    for time in (4.0, 1.0):
        try:
            solver = potpourri3d.MeshHeatMethodDistanceSolver(vertices, faces, t_coef=time)
            row.append(f"{100 * difference(ours, solver.compute_distance(0)):.2f} %")
        except Exception as error:  # a mesh that it refuses
            row.append(str(error).split("\n")[0][:60])
    print(f"| {path.stem} | {' | '.join(row)} |")
