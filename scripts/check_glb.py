#!/usr/bin/env python3
"""Compares a GLB before and after an edit with a reader that is not ours.

    python3 scripts/check_glb.py before.glb after.glb

Needs trimesh, numpy and pillow from PyPI. Positions and normals may differ; faces, texture
coordinates, materials, images and the transforms of the nodes must not.
"""

import sys

import numpy
import trimesh


def load(path):
    return trimesh.load(path, force="scene", process=False)


def image_bytes(image):
    return None if image is None else image.convert("RGBA").tobytes()


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    before, after = (load(path) for path in sys.argv[1:])
    problems = []

    def same(what, a, b):
        if not a == b:
            problems.append(f"{what} differ: {a} and {b}")

    same("the names of the meshes", list(before.geometry), list(after.geometry))
    # Only nodes with meshes, because cameras get different names at every load.
    nodes = [sorted(scene.graph.nodes_geometry) for scene in (before, after)]
    same("the nodes that show meshes", *nodes)
    for node in before.graph.nodes_geometry:
        old, new = before.graph.get(node), after.graph.get(node)
        if not numpy.array_equal(old[0], new[0]):
            problems.append(f"the transform of node {node} differs")
        same(f"the meshes of node {node}", old[1], new[1])
    for name, old in before.geometry.items():
        new = after.geometry.get(name)
        if new is None:
            continue
        if not numpy.array_equal(old.faces, new.faces):
            problems.append(f"the faces of {name} differ")
        uv = [getattr(mesh.visual, "uv", None) for mesh in (old, new)]
        if not numpy.array_equal(*uv) and not (uv[0] is None and uv[1] is None):
            problems.append(f"the texture coordinates of {name} differ")
        materials = [getattr(mesh.visual, "material", None) for mesh in (old, new)]
        names = [getattr(material, "name", None) for material in materials]
        same(f"the names of the materials of {name}", *names)
        images = [
            image_bytes(getattr(material, "baseColorTexture", None)) for material in materials
        ]
        if images[0] != images[1]:
            problems.append(f"the images of {name} differ")
        moved = (old.vertices != new.vertices).any(axis=1).sum()
        welded = new.copy()
        welded.merge_vertices(merge_tex=True, merge_norm=True)
        print(
            f"{name}: {len(new.vertices)} vertices, {moved} moved; welded {len(welded.vertices)}, "
            f"{'closed' if welded.is_watertight else 'open'}"
        )
    for problem in problems:
        print(problem)
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
