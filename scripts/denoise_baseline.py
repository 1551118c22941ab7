"""Results of pymeshlab's smoothing filters on the meshes of the denoising table.

    pip install numpy pymeshlab
    python scripts/denoise_baseline.py ../shared/meshes

Prints mean normal errors in degrees, with equal weight for each face, for the same noise as
`cargo run --release -p cotan-tests --example denoising_table`. pymeshlab has no bilateral normal
filter; the closest are the two-step filters, which smooth the normals and then fit the vertices.
"""

import math
import sys
from pathlib import Path

import numpy as np
import pymeshlab

MASK = (1 << 64) - 1


def gaussian_noise(count, seed=1):
    """Same as cotan::smooth::GaussianNoise: splitmix64, then the cosine of Box and Muller."""
    state = seed

    def uniform():
        nonlocal state
        state = (state + 0x9E3779B97F4A7C15) & MASK
        z = state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
        return 1 - ((z ^ (z >> 31)) >> 11) * 2.0**-53

    pairs = ((uniform(), uniform()) for _ in range(count))
    return np.array([math.sqrt(-2 * math.log(a)) * math.cos(2 * math.pi * b) for a, b in pairs])


def unit(vectors):
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1)


def area_vectors(positions, faces):
    a, b, c = (positions[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def normal_error(clean, other, faces):
    a, b = (unit(area_vectors(x, faces)) for x in (clean, other))
    angles = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(1))
    return np.degrees(angles.mean())


def with_noise(positions, faces, deviation):
    sides = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges = np.unique(np.sort(sides, axis=1), axis=0)
    length = np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1).mean()
    normals = np.zeros_like(positions)
    for k in range(3):
        np.add.at(normals, faces[:, k], area_vectors(positions, faces))
    return positions + unit(normals) * (deviation * length * gaussian_noise(len(positions)))[:, None]


def load(path):
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(path))
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


FILTERS = {
    "two steps": lambda m: m.apply_coord_two_steps_smoothing(),
    "taubin 10": lambda m: m.apply_coord_taubin_smoothing(
        lambda_=0.5, mu=-0.53, stepsmoothnum=10
    ),
    "hc": lambda m: m.apply_coord_hc_laplacian_smoothing(),
    "laplacian 3": lambda m: m.apply_coord_laplacian_smoothing(stepsmoothnum=3),
    "scale dependent": lambda m: m.apply_coord_laplacian_smoothing_scale_dependent(),
}


def rows(folder):
    clean, faces = load(folder / "fandisk.obj")
    yield "fandisk_noisy", clean, load(folder / "fandisk_noisy.obj")[0], faces
    for name in ["dinosaur.obj", "armadillo.ply", "spot.obj"]:
        clean, faces = load(folder / name)
        for deviation in [0.1, 0.2, 0.3]:
            yield f"{name} {deviation}", clean, with_noise(clean, faces, deviation), faces


def main():
    print("| mesh, noise | noisy |", " | ".join(FILTERS), "|")
    for name, clean, noisy, faces in rows(Path(sys.argv[1])):
        cells = [f"{normal_error(clean, noisy, faces):.2f}"]
        for run in FILTERS.values():
            meshes = pymeshlab.MeshSet()
            meshes.add_mesh(pymeshlab.Mesh(noisy, faces))
            run(meshes)
            smoothed = meshes.current_mesh().vertex_matrix()
            cells.append(f"{normal_error(clean, smoothed, faces):.2f}")
        print(f"| {name} |", " | ".join(cells), "|", flush=True)


if __name__ == "__main__":
    main()
