//! Base face lists for random meshes, all constructed directly without edits.

use super::{SplitMix, fans};
use crate::build_error::BuildError;
use crate::mesh::HalfedgeMesh;

/// The triangles of a mesh, as listed in a file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TriangleFaces {
    /// The number of vertices.
    pub num_vertices: usize,
    /// The corners of each triangle.
    pub faces: Vec<[u32; 3]>,
}

/// The polygons of a mesh, as listed in a file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PolygonFaces {
    /// The number of vertices.
    pub num_vertices: usize,
    /// The corners of each polygon.
    pub faces: Vec<Vec<u32>>,
}

impl TriangleFaces {
    /// Builds the connectivity.
    ///
    /// # Errors
    /// If the public fields were changed to something that is not a manifold.
    pub fn mesh(&self) -> Result<HalfedgeMesh, BuildError> {
        HalfedgeMesh::from_faces(self.num_vertices, &self.faces)
    }

    /// The faces of a triangle mesh. For a larger polygon, its first three corners.
    pub fn of(mesh: &HalfedgeMesh) -> Self {
        let faces = mesh
            .faces()
            .map(|f| mesh.triangle(f).map(|v| v.0))
            .collect();
        Self {
            num_vertices: mesh.num_vertices(),
            faces,
        }
    }

    /// Four triangles.
    pub fn tetrahedron() -> Self {
        Self {
            num_vertices: 4,
            faces: vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
        }
    }

    /// Eight triangles: poles 0 and 5, equator 1 to 4.
    pub fn octahedron() -> Self {
        let faces = (0..4).flat_map(|i| {
            let (a, b) = (1 + i, 1 + (i + 1) % 4);
            [[0, a, b], [5, b, a]]
        });
        Self {
            num_vertices: 6,
            faces: faces.collect(),
        }
    }

    /// Twenty triangles: poles 0 and 11, circles 1 to 5 and 6 to 10.
    pub fn icosahedron() -> Self {
        let faces = (0..5).flat_map(|i| {
            let j = (i + 1) % 5;
            let (a, b, c, d) = (1 + i, 1 + j, 6 + i, 6 + j);
            [[0, a, b], [a, c, b], [b, c, d], [11, d, c]]
        });
        Self {
            num_vertices: 12,
            faces: faces.collect(),
        }
    }

    /// The grid of [`PolygonFaces::torus`] with each quad cut in two: genus 1.
    pub fn torus(rows: u32, columns: u32) -> Self {
        Self::halved(&PolygonFaces::torus(rows, columns))
    }

    /// The grid of [`PolygonFaces::grid`] with each quad cut in two: a disc with holes.
    pub fn disc(rows: u32, columns: u32, holes: u64) -> Self {
        Self::halved(&PolygonFaces::grid(rows, columns, holes))
    }

    fn halved(squares: &PolygonFaces) -> Self {
        let faces = squares.faces.iter().flat_map(|face| {
            let [a, b, c, d] = [face[0], face[1], face[2], face[3]];
            [[a, b, c], [a, c, d]]
        });
        Self {
            num_vertices: squares.num_vertices,
            faces: faces.collect(),
        }
    }

    /// Both surfaces as separate components.
    #[must_use]
    pub fn disjoint_union(&self, other: &Self) -> Self {
        let shift = self.num_vertices as u32;
        let moved = other.faces.iter().map(|face| face.map(|v| v + shift));
        Self {
            num_vertices: self.num_vertices + other.num_vertices,
            faces: self.faces.iter().copied().chain(moved).collect(),
        }
    }

    /// Both surfaces joined at their last triangles: the genus is the sum.
    #[must_use]
    pub fn connected_sum(&self, other: &Self) -> Self {
        let (Some(&[a, b, c]), Some(&[p, q, r])) = (self.faces.last(), other.faces.last()) else {
            return self.disjoint_union(other);
        };
        let mut joined = self.disjoint_union(other);
        joined.faces.pop();
        joined.faces.remove(self.faces.len() - 1);
        // The corners of the second triangle become those of the first, in opposite order.
        let shift = self.num_vertices as u32;
        let glued = [(p + shift, a), (q + shift, c), (r + shift, b)];
        let is_glued = |v: u32| glued.iter().any(|&(from, _)| from == v);
        let mut numbers = Vec::with_capacity(joined.num_vertices);
        let mut next = 0;
        for v in 0..joined.num_vertices as u32 {
            numbers.push(next);
            next += u32::from(!is_glued(v));
        }
        for (from, to) in glued {
            numbers[from as usize] = numbers[to as usize];
        }
        for corner in joined.faces.iter_mut().flatten() {
            *corner = numbers[*corner as usize];
        }
        joined.num_vertices -= 3;
        joined
    }

    /// Randomizes vertex indices, face order and first corners. Seed 0 leaves them unchanged.
    #[must_use]
    pub fn shuffled(&self, seed: u64) -> Self {
        let faces = self.faces.iter().map(|face| face.to_vec()).collect();
        let polygons = PolygonFaces {
            num_vertices: self.num_vertices,
            faces,
        }
        .shuffled(seed);
        let faces = polygons
            .faces
            .iter()
            .map(|face| [face[0], face[1], face[2]])
            .collect();
        Self {
            num_vertices: self.num_vertices,
            faces,
        }
    }
}

impl PolygonFaces {
    /// Builds the connectivity.
    ///
    /// # Errors
    /// If the public fields were changed to something that is not a manifold.
    pub fn mesh(&self) -> Result<HalfedgeMesh, BuildError> {
        HalfedgeMesh::from_faces(self.num_vertices, &self.faces)
    }

    /// Quads in rows and columns (at least three of each), closed in both directions.
    pub fn torus(rows: u32, columns: u32) -> Self {
        let (rows, columns) = (rows.max(3), columns.max(3));
        let at = |i: u32, j: u32| (i % rows) * columns + j % columns;
        let squares = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
        let faces =
            squares.map(|(i, j)| vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
        Self {
            num_vertices: (rows * columns) as usize,
            faces: faces.collect(),
        }
    }

    /// Quads in rows and columns (at least one of each), without some of those whose row and
    /// column are odd: the k-th of these is a hole if bit k of `holes` is set.
    ///
    /// Holes touch neither each other nor the border.
    pub fn grid(rows: u32, columns: u32, holes: u64) -> Self {
        let (rows, columns) = (rows.max(1), columns.max(1));
        let at = |i: u32, j: u32| i * (columns + 1) + j;
        let mut faces = Vec::new();
        let mut candidate = 0;
        for i in 0..rows {
            for j in 0..columns {
                if i % 2 == 1 && j % 2 == 1 && i + 1 < rows && j + 1 < columns {
                    candidate += 1;
                    if candidate <= u64::BITS && holes >> (candidate - 1) & 1 == 1 {
                        continue;
                    }
                }
                faces.push(vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        Self {
            num_vertices: ((rows + 1) * (columns + 1)) as usize,
            faces,
        }
    }

    /// A prism over a polygon with `sides` (at least three) corners.
    pub fn prism(sides: u32) -> Self {
        let n = sides.max(3);
        let mut faces = vec![(0..n).rev().collect(), (n..2 * n).collect()];
        faces.extend((0..n).map(|i| {
            let j = (i + 1) % n;
            vec![i, j, n + j, n + i]
        }));
        Self {
            num_vertices: 2 * n as usize,
            faces,
        }
    }

    /// The dual of a closed mesh without vertices of valence 2: a vertex per face and a face per
    /// vertex.
    pub fn dual(mesh: &HalfedgeMesh) -> Self {
        Self {
            num_vertices: mesh.num_faces(),
            faces: fans(mesh),
        }
    }

    /// Randomizes vertex indices, face order and first corners. Seed 0 leaves them unchanged.
    #[must_use]
    pub fn shuffled(&self, seed: u64) -> Self {
        let mut shuffled = self.clone();
        if seed == 0 {
            return shuffled;
        }
        let mut random = SplitMix(seed);
        let mut numbers: Vec<u32> = (0..self.num_vertices as u32).collect();
        random.shuffle(&mut numbers);
        for face in &mut shuffled.faces {
            face.iter_mut().for_each(|v| *v = numbers[*v as usize]);
            let first = random.below(face.len());
            face.rotate_left(first);
        }
        random.shuffle(&mut shuffled.faces);
        shuffled
    }
}
