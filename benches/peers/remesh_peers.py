#!/usr/bin/env python3
"""Decimation and remeshing next to fast-simplification and pymeshlab, in time and distance.

    cargo build --release -p cotan-surface --example peers
    benches/peers/remesh_peers.py decimate|remesh MESH...

Needs numpy, pymeshlab and fast-simplification. Times are seconds of processor time of the call
alone. Distances are the largest of samples on faces, edges and vertices, from the original to the
result and back, divided by the diagonal of the bounding box (decimate) or by the target length
(remesh).
"""

import pathlib
import subprocess
import sys
import tempfile
import time

import fast_simplification
import numpy as np
import pymeshlab

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "target/release/examples/peers"


def load(path):
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(path))
    meshes.meshing_remove_duplicate_vertices()
    meshes.meshing_remove_unreferenced_vertices()
    mesh = meshes.current_mesh()
    return np.ascontiguousarray(mesh.vertex_matrix()), np.ascontiguousarray(
        mesh.face_matrix().astype(np.int32)
    )


def write_off(path, mesh):
    vertices, faces = mesh
    with open(path, "w") as file:
        file.write(f"OFF\n{len(vertices)} {len(faces)} 0\n")
        np.savetxt(file, vertices, fmt="%.17g")
        np.savetxt(file, np.c_[np.full(len(faces), 3), faces], fmt="%d")


def read_off(path):
    words = pathlib.Path(path).read_text().split()
    vertices, faces = int(words[1]), int(words[2])
    end = 4 + 3 * vertices
    points = np.array(words[4:end], float).reshape(-1, 3)
    return points, np.array(words[end : end + 4 * faces], int).reshape(-1, 4)[:, 1:]


def distances(a, b):
    meshes = pymeshlab.MeshSet()
    for vertices, faces in (a, b):
        meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    count = min(500_000, max(3 * len(b[1]), len(a[0])))
    options = dict(samplenum=count, sampleface=True, sampleedge=True)
    there = meshes.get_hausdorff_distance(sampledmesh=0, targetmesh=1, **options)
    back = meshes.get_hausdorff_distance(sampledmesh=1, targetmesh=0, **options)
    return there["max"], back["max"]


def quality(mesh, length):
    """The least angle, faces with one below 25 degrees, and the share of even edges."""
    points, faces = mesh
    sides = [points[faces[:, (k + 1) % 3]] - points[faces[:, k]] for k in range(3)]
    lengths = [np.linalg.norm(side, axis=1) for side in sides]
    cosines = [
        -(sides[k] * sides[k - 1]).sum(1) / np.maximum(lengths[k] * lengths[k - 1], 1e-300)
        for k in range(3)
    ]
    angles = np.degrees(np.arccos(np.clip(cosines, -1, 1))).min(0)
    share = np.concatenate(lengths) / length
    even = ((share > 0.75) & (share < 1.35)).mean()
    return f"{angles.min():.1f} | {(angles < 25).sum()} | {100 * even:.2f}"


def ours(job, mesh, amount):
    with tempfile.TemporaryDirectory() as folder:
        names = [f"{folder}/in.off", f"{folder}/out.off"]
        write_off(names[0], mesh)
        command = [PROGRAM, job, names[0], repr(float(amount)), names[1]]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        return float(done.stdout.split()[0]), read_off(names[1])


def meshlab(mesh, work):
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(*mesh))
    clock = time.process_time()
    work(meshes)
    seconds = time.process_time() - clock
    made = meshes.current_mesh()
    return seconds, (made.vertex_matrix(), made.face_matrix())


def decimate(name, mesh):
    diagonal = np.linalg.norm(np.ptp(mesh[0], axis=0))
    for share in (0.1, 0.01):
        count = int(len(mesh[1]) * share)
        clock = time.process_time()
        made = fast_simplification.simplify(*mesh, target_count=count)
        fast = time.process_time() - clock
        lab = meshlab(
            mesh,
            lambda meshes: meshes.meshing_decimation_quadric_edge_collapse(
                targetfacenum=count, preservetopology=True, preservenormal=True, qualitythr=0.3
            ),
        )
        rows = [("cotan", ours("decimate", mesh, count)), ("fast-simplification", (fast, made))]
        for program, (seconds, result) in [*rows, ("pymeshlab", lab)]:
            there, back = (d / diagonal for d in distances(mesh, result))
            print(f"| {name} | {share} | {program} | {len(result[1])} | {seconds:.2f} "
                  f"| {there:.5f} | {back:.5f} |", flush=True)


def remesh(name, mesh):
    points, faces = mesh
    edges = np.unique(np.sort(np.vstack([faces[:, [k, (k + 1) % 3]] for k in range(3)])), axis=0)
    mean = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1).mean()
    for factor in (1, 0.5):
        length = mean * factor
        rows = [("cotan", ours("remesh", mesh, length))]
        if "--alone" not in sys.argv:
            lab = meshlab(
                mesh,
                lambda meshes: meshes.meshing_isotropic_explicit_remeshing(
                    iterations=10, targetlen=pymeshlab.PureValue(length), featuredeg=45
                ),
            )
            rows.append(("pymeshlab", lab))
        for program, (seconds, result) in rows:
            there, back = (d / length for d in distances(mesh, result))
            print(f"| {name} | {factor} | {program} | {len(result[1])} | {seconds:.2f} "
                  f"| {quality(result, length)} | {there:.3f} | {back:.3f} |", flush=True)


def main():
    jobs = {"decimate": decimate, "remesh": remesh}
    if len(sys.argv) < 3 or sys.argv[1] not in jobs:
        sys.exit(__doc__)
    for path in (argument for argument in sys.argv[2:] if not argument.startswith("--")):
        jobs[sys.argv[1]](pathlib.Path(path).stem, load(path))


if __name__ == "__main__":
    main()
