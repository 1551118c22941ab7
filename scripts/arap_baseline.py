#!/usr/bin/env python3
"""Baseline for deformation: libigl's as-rigid-as-possible (ARAP), measured like our own results.

    pip install libigl numpy  # written for libigl 2.6.3
    python arap_baseline.py [DATA] [--out OUT] [--only NAME ...]

DATA (default ../shared) contains meshes/, meshes/bend_benchmark/ and reference/deform.json. The
cases are all of deform.json (hard handles; positions scaled by V -> (V - box min) / longest side)
and the two bend benchmarks (file units). libigl's ARAP in 3D, spokes and rims (its default),
starts from the rest positions with the handles moved. It runs one iteration at a time until the
largest displacement of a vertex over the rest box's diagonal is below 1e-4, or for 200 iterations;
for 60 if an iteration takes more than 3 s.

Writes OUT/<mesh>_<drag>.obj and OUT/<bar|cylinder>_benchmark.obj (vertex order and faces of the
input, full precision) and OUT/arap.json. Prints a markdown table, including the published results
of the benchmark.

Errors, with the longest side of the rest mesh's box scaled to 1; w = cot + cot,
l_i = sum_j w_ij (v_j - v_i), 0 = rest:
  E_p    sqrt(sum over directed edges (w0 - w)^2 / n)
  E_g    sqrt(sum over vertices (|l0| - |l|)^2)
  ARAP   sum_i sum_j (w0_ij / 8) |e_ij - R_i e0_ij|^2 / rest area, R_i the one-ring's best rotation
  edges  root mean square of (length / rest length - 1); volume: ratio to rest, closed meshes only
  folds  edges whose face normals have cos < -0.5 now and >= -0.5 at rest
"""
import argparse
import json
import os
import time
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "IGL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # libraries read them when imported

import igl  # noqa: E402
import numpy as np  # noqa: E402

TOLERANCES, MAX_ITERATIONS, SLOW_SECONDS, SLOW_ITERATIONS = (1e-3, 1e-4), 200, 3.0, 60
PUBLISHED = ("PriMo", "linear shell", "gradient", "Laplacian", "rotation-invariant")  # files 01-*.off ... 05-*.off
PLY_TYPES = {"uchar": "u1", "uint8": "u1", "int": "i4", "int32": "i4", "float": "f4", "float32": "f4", "double": "f8"}


# Readers of triangle meshes that keep the vertex order of the file.
def read_obj(path):
    lines = [line.split() for line in path.read_text().splitlines()]
    faces = [[int(corner.split("/")[0]) - 1 for corner in line[1:]] for line in lines if line[:1] == ["f"]]
    return np.array([line[1:4] for line in lines if line[:1] == ["v"]], float), np.array(faces, np.int64)


def read_off(path):
    rows = [row.split() for row in path.read_text().splitlines() if row.strip()]
    n, m = int(rows[1][0]), int(rows[1][1])
    return np.array(rows[2:n + 2], float), np.array(rows[n + 2:n + m + 2], np.int64)[:, 1:]


def read_ply(path):
    """Reads binary PLY in either byte order: vertices with x, y, z, then faces with one list."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    lines = [line.split() for line in header.decode("ascii").splitlines()]
    order = {"binary_big_endian": ">", "binary_little_endian": "<"}[lines[1][1]]
    n, m = (int(line[2]) for line in lines if line[0] == "element")
    *scalars, (_, count, corner, _) = (line[1:] for line in lines if line[0] == "property")
    point = np.dtype([(name, order + PLY_TYPES[kind]) for kind, name in scalars])
    triangle = np.dtype([("count", order + PLY_TYPES[count]), ("corners", order + PLY_TYPES[corner], 3)])
    points, triangles = np.frombuffer(body, point, n), np.frombuffer(body, triangle, m, n * point.itemsize)
    assert (triangles["count"] == 3).all(), f"{path}: a face that is no triangle"
    return np.stack([points[c] for c in "xyz"], 1).astype(float), triangles["corners"].astype(np.int64)


def read_mesh(path):
    return {".obj": read_obj, ".off": read_off, ".ply": read_ply}[path.suffix](path)


def write_obj(path, vertices, faces):
    with open(path, "w") as out:
        out.writelines("v %.17g %.17g %.17g\n" % tuple(v) for v in vertices)
        out.writelines("f %d %d %d\n" % tuple(f) for f in faces + 1)


class Measure:
    """The errors of deformed positions of one mesh. Edges are undirected vertex pairs i < j."""

    def __init__(self, rest, faces):
        self.low, self.scale, self.faces, self.n = rest.min(0), np.ptp(rest, axis=0).max(), faces, len(rest)
        self.rest = (rest - self.low) / self.scale
        opposite = np.sort(faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), 1)  # opposite each face's corners
        self.edges, edge_of, count = np.unique(opposite, axis=0, return_inverse=True, return_counts=True)
        self.edge_of, self.closed = edge_of.reshape(-1), (count == 2).all()
        by_edge, last = np.argsort(self.edge_of, kind="stable"), np.cumsum(count)[count == 2] - 1
        self.sides = by_edge[last - 1] // 3, by_edge[last] // 3  # the two faces at each inner edge
        self.area = np.linalg.norm(self.normals(self.rest), axis=1).sum() / 2

    def normals(self, x):
        return np.cross(x[self.faces[:, 1]] - x[self.faces[:, 0]], x[self.faces[:, 2]] - x[self.faces[:, 0]])

    def weights(self, x):
        p = x[self.faces]
        a, b = np.roll(p, -1, 1) - p, np.roll(p, -2, 1) - p  # the edges at each corner
        floor = 1e-12 * (a * a).sum((1, 2))[:, None]
        cot = (a * b).sum(2) / np.maximum(np.linalg.norm(np.cross(a, b), axis=2), floor)
        return np.bincount(self.edge_of, cot.ravel(), len(self.edges))

    def at_vertices(self, to_i, to_j):
        """Sums per-edge rows of numbers at the vertices: to_i at end i and to_j at end j."""
        i, j = self.edges.T
        return np.stack([np.bincount(i, p, self.n) + np.bincount(j, q, self.n) for p, q in zip(to_i.T, to_j.T)], 1)

    def arap(self, e, e0, w):
        moment = (w[:, None, None] * e[:, :, None] * e0[:, None, :]).reshape(-1, 9)
        u, _, vt = np.linalg.svd(self.at_vertices(moment, moment).reshape(-1, 3, 3))
        u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
        off = [e - np.einsum("kab,kb->ka", (u @ vt)[end], e0) for end in self.edges.T]
        return sum((w * (d * d).sum(1)).sum() for d in off) / 8 / self.area

    def folded(self, x):
        normal = self.normals(x)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        return (normal[self.sides[0]] * normal[self.sides[1]]).sum(1) < -0.5

    def __call__(self, positions):
        x, x0, (i, j) = (positions - self.low) / self.scale, self.rest, self.edges.T
        volume, volume0 = (np.linalg.det(p[self.faces]).sum() for p in (x, x0))
        w, w0, e, e0 = self.weights(x), self.weights(x0), x[j] - x[i], x0[j] - x0[i]
        size, size0 = (np.linalg.norm(self.at_vertices(d, -d), axis=1) for d in (w[:, None] * e, w0[:, None] * e0))
        stretch = np.linalg.norm(e, axis=1) / np.linalg.norm(e0, axis=1)
        return {"E_p": float(np.sqrt(2 * ((w - w0) ** 2).sum() / self.n)),
                "E_g": float(np.linalg.norm(size - size0)),
                "arap_energy": float(self.arap(e, e0, w0)),
                "edge_rms": float(np.sqrt(((stretch - 1) ** 2).mean())),
                "volume_ratio": float(volume / volume0) if self.closed else None,
                "folded_edges": int((self.folded(x) & ~self.folded(x0)).sum())}


def deform(rest, faces, handles, targets):
    data, start = igl.ARAPData(), time.perf_counter()
    data.energy, data.max_iter = igl.ARAP_ENERGY_TYPE_SPOKES_AND_RIMS, 1
    igl.arap_precomputation(rest, faces, 3, handles.astype(np.int32), data)
    precompute = time.perf_counter() - start
    x, limit, seconds, moves = rest.copy(), MAX_ITERATIONS, [], []
    x[handles] = targets
    while len(moves) < limit and not (moves and moves[-1] < TOLERANCES[-1]):
        start, previous = time.perf_counter(), x
        x = igl.arap_solve(targets, data, previous)
        seconds.append(time.perf_counter() - start)
        moves.append(float(np.linalg.norm(x - previous, axis=1).max() / np.linalg.norm(np.ptp(rest, axis=0))))
        if len(seconds) == 3 and min(seconds) > SLOW_SECONDS:
            limit = SLOW_ITERATIONS
    to = [next((k + 1 for k, move in enumerate(moves) if move < t), None) for t in TOLERANCES]
    return x, {"iterations": len(moves), "iterations_to_1e-3": to[0], "iterations_to_1e-4": to[1],
               "last_move": moves[-1], "precompute_seconds": precompute, "seconds": sum(seconds),
               "seconds_per_iteration": np.median(seconds)}


def row(name, report):
    limit = f"> {report['iterations']}" if "iterations" in report else ""
    volume = "open" if report["volume_ratio"] is None else f"{report['volume_ratio']:.4f}"
    print(f"| {name} | {report.get('iterations_to_1e-3') or limit} | {report.get('iterations_to_1e-4') or limit} "
          f"| {report['E_p']:.4g} | {report['E_g']:.4g} | {report['arap_energy']:.4g} "
          f"| {100 * report['edge_rms']:.2f} % | {volume} | {report['folded_edges']} |", flush=True)


def cases(data):
    """Yields name, rest mesh, faces, handles, targets and folder of published results per case."""
    for folder in sorted((data / "meshes" / "bend_benchmark").iterdir()):
        rest, faces = read_mesh(folder / f"00-{folder.name}-original.off")
        status, matrix = (np.loadtxt(folder / (folder.name + suffix)) for suffix in (".sel", ".def"))
        target = np.where((status == 2)[:, None], rest @ matrix[:3, :3].T + matrix[:3, 3], rest)
        handles = np.flatnonzero(status != 1)  # 0 fixed, 1 free, 2 moved
        yield f"{folder.name}_benchmark", rest, faces, handles, target[handles], folder
    for case in json.loads((data / "reference" / "deform.json").read_text())["deform"]:
        rest, faces = read_mesh(data / "meshes" / case["mesh"])
        rest, name = (rest - rest.min(0)) / np.ptp(rest, axis=0).max(), f"{Path(case['mesh']).stem}_{case['drag']}"
        yield name, rest, faces, np.array(case["handles"]), np.array(case["targets"], float), None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", nargs="?", type=Path, default=Path("../shared"))
    parser.add_argument("--out", type=Path, default=Path("arap"))
    parser.add_argument("--only", nargs="*", help="names of cases, such as spot_twist")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    reports = {}
    print("| case | to 1e-3 | to 1e-4 | E_p | E_g | ARAP energy | edge rms | volume | folds |\n" + "|---" * 9 + "|")
    for name, rest, faces, handles, targets, folder in cases(args.data):
        if args.only and name not in args.only:
            continue
        measure = Measure(rest, faces)
        x, report = deform(rest, faces, handles, targets)
        reports[name] = report | measure(x)
        write_obj(args.out / f"{name}.obj", x, faces)
        row(name, reports[name])
        for number, method in enumerate(PUBLISHED if folder else (), 1):
            published, same = read_mesh(next(folder.glob(f"0{number}-*.off")))
            assert np.array_equal(same, faces), f"{folder}, {method}: other faces"
            reports[f"{name}, {method}"] = measure(published)
            row(f"{name}, {method}", reports[f"{name}, {method}"])
        (args.out / "arap.json").write_text(json.dumps(reports, indent=1) + "\n")


if __name__ == "__main__":
    main()
