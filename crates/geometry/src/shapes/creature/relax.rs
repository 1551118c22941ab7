//! Turns a net into well-shaped triangles: vertices slide along the surface towards the middle of
//! their neighbours, and each quad is cut along its better diagonal.

use cotan_parallel::Chunks;
use nalgebra::{Point3, Vector3};

use super::field::Field;
use super::flips::quality;
use super::nets::Net;

/// Moves each vertex towards the mean of its neighbours within the tangent plane, and back onto
/// the surface, `rounds` times.
pub(super) fn relax(
    points: &mut Vec<Point3<f64>>,
    neighbours: &Neighbours,
    field: &Field,
    rounds: usize,
) {
    for _ in 0..rounds {
        *points = CHUNKS.filled(points.len(), |i| {
            let p = points[i];
            let (onto, normal) = field.step_to_surface(&p);
            let ring = neighbours.of(i);
            let sum: Vector3<f64> = ring.iter().map(|&j| points[j as usize] - p).sum();
            let halfway = sum * (0.5 / ring.len() as f64);
            // The normal part is removed: at a thin tip the mean lies deep inside, and a vertex
            // moved there would not return to the tip.
            p + onto + halfway - normal * normal.dot(&halfway)
        });
    }
}

/// Moves each vertex onto the surface.
pub(super) fn project(points: &mut [Point3<f64>], field: &Field) {
    CHUNKS.update(points, |_, p| {
        for _ in 0..PROJECTION_STEPS {
            *p += field.step_to_surface(p).0;
        }
    });
}

/// The neighbours of each vertex.
pub(super) struct Neighbours {
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

impl Neighbours {
    /// Joins consecutive corners of each polygon.
    pub(super) fn new<const N: usize>(num_vertices: usize, polygons: &[[u32; N]]) -> Self {
        let sides = || {
            polygons
                .iter()
                .flat_map(|polygon| (0..N).map(|k| (polygon[k], polygon[(k + 1) % N])))
        };
        let mut starts = vec![0; num_vertices + 1];
        for (a, _) in sides() {
            starts[a as usize + 1] += 1;
        }
        for i in 0..num_vertices {
            starts[i + 1] += starts[i];
        }
        let mut cursor = starts.clone();
        // On a closed surface each side occurs once in each direction.
        let mut neighbours = vec![0; starts[num_vertices] as usize];
        for (a, b) in sides() {
            let slot = &mut cursor[a as usize];
            neighbours[*slot as usize] = b;
            *slot += 1;
        }
        Self { starts, neighbours }
    }

    fn of(&self, i: usize) -> &[u32] {
        &self.neighbours[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}

/// Cuts each quad along the diagonal that gives the larger smallest angle.
pub(super) fn triangulate(net: &Net) -> Vec<[u32; 3]> {
    let cut = |&[a, b, c, d]: &[u32; 4]| {
        let (along, across) = ([[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]);
        let is_better = quality(&net.points, &along) >= quality(&net.points, &across);
        if is_better { along } else { across }
    };
    net.quads.iter().flat_map(cut).collect()
}

/// Vertices per task, which amounts to a few hundred evaluations of the field.
const CHUNKS: Chunks = Chunks::of(256);

/// Newton's method converges quadratically, from the error of about a hundredth of a cell left by
/// relaxation.
const PROJECTION_STEPS: usize = 3;
