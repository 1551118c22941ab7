//! A surface as a model of several parts: its connected components, with their measures.

use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::{Components, VertexId};
use nalgebra::{Point3, Vector3};

/// A connected component.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Part {
    /// Its vertices, ascending.
    pub(crate) vertices: Vec<u32>,
    /// Its triangles, in the order of the mesh.
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) area: f64,
    /// The diagonal of its bounding box.
    pub(crate) size: f64,
}

/// A surface of several parts. Its vertices are rows: copies of a vertex, in a mesh that was cut
/// into pieces, are one.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) parts: Vec<Part>,
    /// Per vertex: its part.
    pub(crate) of_vertex: Vec<u32>,
    pub(crate) positions: Positions<f64>,
    /// A third of the area of the triangles around each vertex.
    pub(crate) areas: Vec<f64>,
    /// The triangles around each vertex: those of vertex i are `fans[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    fans: Vec<[u32; 3]>,
    /// The diagonal of the bounding box.
    pub(crate) diagonal: f64,
    /// Twice the greatest distance of a vertex from the centroid of the surface.
    pub(crate) extent: f64,
}

impl Model {
    /// The parts of a surface, numbered by their first vertices.
    pub(crate) fn new<T: Scalar>(surface: &Surface<'_, T>, components: &Components) -> Self {
        let mesh = surface.mesh();
        let positions = mesh.to_rows(&surface.positions().map(|p| p.map(T::as_f64)));
        let of_vertex = components.of_vertices().values().copied();
        let of_vertex: Vec<u32> = of_vertex.take(positions.len()).collect();
        let mut parts = vec![
            Part {
                vertices: Vec::new(),
                triangles: Vec::new(),
                area: 0.0,
                size: 0.0,
            };
            components.count()
        ];
        for (v, part) in of_vertex.iter().enumerate() {
            parts[*part as usize].vertices.push(v as u32);
        }
        let triangles: Vec<[u32; 3]> = mesh
            .faces()
            .map(|f| mesh.triangle(f).map(|v| mesh.row_of(v).index() as u32))
            .collect();
        let mut areas = vec![0.0; positions.len()];
        for triangle in &triangles {
            let area = area(&positions, triangle);
            let part = &mut parts[of_vertex[triangle[0] as usize] as usize];
            part.triangles.push(*triangle);
            part.area += area;
            triangle
                .iter()
                .for_each(|v| areas[*v as usize] += area / 3.0);
        }
        for part in &mut parts {
            part.size = diagonal(part.vertices.iter().map(|v| at(&positions, *v)));
        }
        let (starts, fans) = fans(positions.len(), &triangles);
        let all: Vec<u32> = (0..positions.len() as u32).collect();
        Self {
            diagonal: diagonal(positions.values().copied()),
            extent: extent(&positions, &all, &triangles),
            parts,
            of_vertex,
            areas,
            starts,
            fans,
            positions,
        }
    }

    /// The part of a vertex.
    pub(crate) fn part_of(&self, vertex: VertexId) -> usize {
        self.of_vertex[vertex.index()] as usize
    }

    pub(crate) fn at(&self, vertex: u32) -> Point3<f64> {
        at(&self.positions, vertex)
    }

    /// Opposite corners of the bounding box of some vertices.
    pub(crate) fn bounds(&self, vertices: &[u32]) -> [Point3<f64>; 2] {
        let first = vertices.first().map_or(Point3::origin(), |v| self.at(*v));
        vertices.iter().fold([first; 2], |[min, max], v| {
            let p = self.at(*v);
            [min.inf(&p), max.sup(&p)]
        })
    }

    /// The triangles around a vertex.
    pub(crate) fn fan(&self, vertex: u32) -> &[[u32; 3]] {
        let range =
            self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize;
        &self.fans[range]
    }

    /// [`Model::extent`] of a part by itself.
    pub(crate) fn extent_of(&self, part: usize) -> f64 {
        let part = &self.parts[part];
        extent(&self.positions, &part.vertices, &part.triangles)
    }

    /// Returns true if a part is smaller than another by more than rounding.
    pub(crate) fn is_smaller(&self, part: usize, other: usize) -> bool {
        self.parts[part].size < self.parts[other].size * (1.0 - SAME)
    }

    /// An order of two parts that does not depend on their indices: by size, number of vertices,
    /// and position.
    pub(crate) fn comes_first(&self, part: usize, other: usize) -> bool {
        if self.is_smaller(part, other) || self.is_smaller(other, part) {
            return self.is_smaller(part, other);
        }
        let [a, b] = [part, other].map(|p| &self.parts[p]);
        if a.vertices.len() != b.vertices.len() {
            return a.vertices.len() < b.vertices.len();
        }
        let place = |part: &Part| {
            let vertices = part.vertices.iter();
            let sum: Vector3<f64> = vertices.map(|v| self.at(*v).coords).sum();
            sum / part.vertices.len().max(1) as f64
        };
        let way = place(b) - place(a);
        let along = way.iter().find(|x| x.abs() > SAME * self.diagonal);
        along.map_or(part < other, |x| *x > 0.0)
    }

    /// Returns true if a part has so little area for its size that its cotangents are noise.
    pub(crate) fn is_degenerate(&self, part: usize) -> bool {
        /// Of the squared size.
        const LEAST: f64 = 1e-9;
        let part = &self.parts[part];
        !(part.area > LEAST * part.size * part.size)
    }
}

/// Lengths whose relative difference is smaller than this differ only by rounding.
const SAME: f64 = 1e-6;

pub(super) fn at(positions: &Positions<f64>, vertex: u32) -> Point3<f64> {
    positions.as_slice()[vertex as usize]
}

fn area(positions: &Positions<f64>, triangle: &[u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|v| at(positions, v));
    0.5 * (b - a).cross(&(c - a)).norm()
}

fn diagonal(points: impl Iterator<Item = Point3<f64>>) -> f64 {
    let mut bounds: Option<[Point3<f64>; 2]> = None;
    for p in points {
        bounds = Some(match bounds {
            None => [p, p],
            Some([min, max]) => [min.inf(&p), max.sup(&p)],
        });
    }
    bounds.map_or(0.0, |[min, max]| (max - min).norm())
}

/// Twice the greatest distance of a vertex from the centroid of the surface; without area, from
/// the mean of the vertices.
fn extent(positions: &Positions<f64>, vertices: &[u32], triangles: &[[u32; 3]]) -> f64 {
    let (mut moment, mut total) = (Vector3::zeros(), 0.0);
    for triangle in triangles {
        let area = area(positions, triangle);
        let corners: Vector3<f64> = triangle.iter().map(|v| at(positions, *v).coords).sum();
        moment += corners * (area / 3.0);
        total += area;
    }
    let center = if total > 0.0 {
        moment / total
    } else {
        let sum: Vector3<f64> = vertices.iter().map(|v| at(positions, *v).coords).sum();
        sum / vertices.len().max(1) as f64
    };
    let distances = vertices
        .iter()
        .map(|v| (at(positions, *v).coords - center).norm());
    2.0 * distances.fold(0.0, f64::max)
}

/// The triangles around every vertex, in their order.
fn fans(num_vertices: usize, triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<[u32; 3]>) {
    let mut starts = vec![0; num_vertices + 1];
    for v in triangles.iter().flatten() {
        starts[*v as usize + 1] += 1;
    }
    for v in 0..num_vertices {
        starts[v + 1] += starts[v];
    }
    let mut cursor = starts.clone();
    let mut fans = vec![[0; 3]; 3 * triangles.len()];
    for triangle in triangles {
        for v in triangle {
            let slot = &mut cursor[*v as usize];
            fans[*slot as usize] = *triangle;
            *slot += 1;
        }
    }
    (starts, fans)
}
