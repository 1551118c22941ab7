//! Spatial vertex order: neighbours in space become neighbours in memory.
//!
//! If the vertices of a mesh are in random order, every pass over its triangles waits for memory:
//! building the mesh takes four times as long, and so do weights, normals and right-hand sides.
//! Sorting the vertices along a space-filling curve (Z-order: the interleaved bits of the three
//! coordinates) costs less than one such pass loses.

use cotan_halfedge::{BuildError, FaceId, HalfedgeMesh, VertexId, VertexMap};
use cotan_parallel as parallel;
use nalgebra::Point3;

use crate::mesh::Mesh;
use crate::scalar::Scalar;
use crate::surface::Positions;

/// A permutation of the vertices of a mesh along a curve that fills its bounding box.
///
/// It depends on the positions only, so two embeddings of one mesh have different orders. Use one
/// order for both.
///
/// ```
/// use cotan_geometry::SpatialOrder;
/// use cotan_geometry::shapes::{VertexOrder, irregular};
/// use cotan_halfedge::HalfedgeMesh;
///
/// let shape = irregular::<f64>(10_000, VertexOrder::Random, 1);
/// let faces: Vec<[u32; 3]> = shape
///     .connectivity()
///     .faces()
///     .map(|f| shape.connectivity().triangle(f).map(|v| v.index() as u32))
///     .collect();
/// assert!(SpatialOrder::is_scattered(shape.positions().len(), &faces));
///
/// let order = SpatialOrder::of(shape.positions());
/// let (near, _) = order.faces(&faces);
/// assert!(!SpatialOrder::is_scattered(shape.positions().len(), &near));
/// let mesh = HalfedgeMesh::from_faces(shape.positions().len(), &near)?;
/// // … work on the mesh with these positions …
/// let positions = order.gather(shape.positions());
/// assert_eq!(&order.scatter(&positions), shape.positions());
/// # Ok::<(), cotan_halfedge::BuildError>(())
/// ```
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SpatialOrder {
    /// The old index of each vertex by its new one, and vice versa.
    old: VertexMap<VertexId>,
    new: VertexMap<VertexId>,
}

impl SpatialOrder {
    /// Sorts the vertices by position. Vertices with equal positions keep their relative order.
    ///
    /// Takes about 30 nanoseconds per vertex.
    #[must_use]
    pub fn of<T: Scalar>(positions: &Positions<T>) -> Self {
        let points = positions.as_slice();
        let grid = Grid::of(points);
        // The upper half of the key nearly always decides, and fits into one word together with
        // the index.
        let key = |i: usize| (grid.key(&points[i]) >> 32 << 32) | i as u64;
        let mut sorted: Vec<u64> = parallel::filled(points.len(), key);
        parallel::sort_unstable(&mut sorted);
        let number = |entry: u64| entry as u32 as usize;
        for run in sorted.chunk_by_mut(|a, b| a >> 32 == b >> 32) {
            if run.len() > LONGEST_RUN {
                run.sort_by_cached_key(|&entry| (grid.key(&points[number(entry)]), entry));
            }
        }
        let old: Vec<VertexId> = sorted.iter().map(|&e| VertexId::new(number(e))).collect();
        let mut new = VertexMap::filled(old.len(), VertexId::new(0));
        for (k, &v) in old.iter().enumerate() {
            new[v] = VertexId::new(k);
        }
        Self {
            old: VertexMap::from_vec(old),
            new,
        }
    }

    /// Returns true if triangles that are close together in `faces` have widely scattered
    /// corners, so that a spatial order pays off.
    ///
    /// Counts the blocks of 16 vertex indices that runs of 64 faces touch: about 0.2 per face if
    /// the indices are close together, up to 3 if they are random. More than 1 counts as
    /// scattered.
    /// Small meshes are never scattered, because caches hold them in any order. Only a sample of
    /// the faces is examined.
    #[must_use]
    pub fn is_scattered(num_vertices: usize, faces: &[[u32; 3]]) -> bool {
        if num_vertices < SMALL || faces.len() < RUN {
            return false;
        }
        let num_runs = (faces.len() / RUN).min(MAX_RUNS);
        let stride = (faces.len() - RUN) / num_runs.max(1);
        let mut num_blocks = 0;
        for run in 0..num_runs {
            let run = &faces[run * stride..run * stride + RUN];
            let mut blocks: Vec<u32> = run.as_flattened().iter().map(|v| v / BLOCK).collect();
            blocks.sort_unstable();
            blocks.dedup();
            num_blocks += blocks.len();
        }
        num_blocks > num_runs * RUN
    }

    /// The new index of a vertex.
    ///
    /// # Panics
    /// If there is no such vertex.
    #[inline]
    #[must_use]
    pub fn new_id(&self, old: VertexId) -> VertexId {
        self.new[old]
    }

    /// The old index of a vertex.
    ///
    /// # Panics
    /// If there is no such vertex.
    #[inline]
    #[must_use]
    pub fn old_id(&self, new: VertexId) -> VertexId {
        self.old[new]
    }

    /// Renumbers the triangles and sorts them by their first corner. Returns them with the old
    /// index of each.
    ///
    /// # Panics
    /// If a corner is not a vertex.
    #[must_use]
    pub fn faces(&self, faces: &[[u32; 3]]) -> (Vec<[u32; 3]>, Vec<FaceId>) {
        let renumbered =
            |face: &[u32; 3]| face.map(|v| self.new[VertexId::new(v as usize)].index() as u32);
        // A counting sort: for each vertex, the next free slot for its faces.
        let mut places = vec![0u32; self.new.len() + 1];
        let first: Vec<u32> = faces
            .iter()
            .map(|face| renumbered(face).into_iter().fold(u32::MAX, u32::min))
            .collect();
        for &v in &first {
            places[v as usize + 1] += 1;
        }
        for v in 0..self.new.len() {
            places[v + 1] += places[v];
        }
        let mut old = vec![FaceId::new(0); faces.len()];
        for (face, &v) in first.iter().enumerate() {
            let place = &mut places[v as usize];
            old[*place as usize] = FaceId::new(face);
            *place += 1;
        }
        let sorted = old.iter().map(|f| renumbered(&faces[f.index()]));
        (sorted.collect(), old)
    }

    /// Reorders a map from the old indices to the new ones.
    ///
    /// # Panics
    /// If the map does not have one entry per vertex.
    #[must_use]
    pub fn gather<V: Clone>(&self, map: &VertexMap<V>) -> VertexMap<V> {
        assert_eq!(map.len(), self.old.len(), "one entry a vertex");
        self.old.map(|&v| map[v].clone())
    }

    /// Reorders a map from the new indices back to the old ones.
    ///
    /// # Panics
    /// If the map does not have one entry per vertex.
    #[must_use]
    pub fn scatter<V: Clone>(&self, map: &VertexMap<V>) -> VertexMap<V> {
        assert_eq!(map.len(), self.new.len(), "one entry a vertex");
        self.new.map(|&v| map[v].clone())
    }
}

/// A grid of 2²¹ cells along the longest side of the bounding box.
struct Grid {
    low: Point3<f64>,
    cells_per_length: f64,
}

impl Grid {
    fn of<T: Scalar>(points: &[Point3<T>]) -> Self {
        let mut low = Point3::from([f64::INFINITY; 3]);
        let mut high = Point3::from([f64::NEG_INFINITY; 3]);
        for p in points {
            let p = p.map(Scalar::as_f64);
            (low, high) = (low.inf(&p), high.sup(&p));
        }
        let longest = (high - low).amax();
        Self {
            low,
            cells_per_length: CELLS / longest,
        }
    }

    /// The index of the point's cell along the curve, or 0 if the position is not meaningful.
    fn key<T: Scalar>(&self, p: &Point3<T>) -> u64 {
        let cell = (p.map(Scalar::as_f64) - self.low) * self.cells_per_length;
        // Casting turns NaN into 0; everything else is clamped.
        let [x, y, z] = [cell.x, cell.y, cell.z].map(|x| spread(x.clamp(0.0, CELLS - 1.0) as u64));
        x | y << 1 | z << 2
    }
}

/// Inserts two zeros between each of the lowest 21 bits.
fn spread(x: u64) -> u64 {
    let mut x = x & 0x1f_ffff;
    x = (x | x << 32) & 0x001f_0000_0000_ffff;
    x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

impl<T: Scalar> Mesh<T> {
    /// Returns the same mesh with its vertices and faces in spatial order, and the order itself.
    ///
    /// # Errors
    /// Those of [`HalfedgeMesh::from_faces`], none of which can be caused by renumbering.
    pub fn in_spatial_order(&self) -> Result<(Self, SpatialOrder), BuildError> {
        let order = SpatialOrder::of(self.positions());
        let corners = |f| self.connectivity().triangle(f).map(|v| v.index() as u32);
        let faces: Vec<[u32; 3]> = self.connectivity().faces().map(corners).collect();
        let faces = order.faces(&faces).0;
        let connectivity = HalfedgeMesh::from_faces(self.num_vertices(), &faces)?;
        let positions = order.gather(self.positions());
        Ok((Self::assume_checked(connectivity, positions), order))
    }
}

const CELLS: f64 = (1 << 21) as f64;

/// The number of vertices that may share a cell of the upper half of the key in any order: a few
/// cache lines.
const LONGEST_RUN: usize = 16;

/// Meshes with fewer vertices than this fit into a core's cache at a few hundred bytes per
/// vertex.
const SMALL: usize = 1 << 12;

/// Faces per run, and vertex indices per block: 16 positions are six cache lines.
const RUN: usize = 64;
const BLOCK: u32 = 16;

/// The number of runs examined, evenly spread.
const MAX_RUNS: usize = 256;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{VertexOrder, creature, icosphere, irregular, torus};
    use crate::{surface_area, volume};

    fn faces<T: Scalar>(shape: &Mesh<T>) -> Vec<[u32; 3]> {
        let corners = |f| shape.connectivity().triangle(f).map(|v| v.index() as u32);
        shape.connectivity().faces().map(corners).collect()
    }

    #[test]
    fn the_order_is_a_permutation_and_the_surface_stays() {
        let shape = irregular::<f64>(6_000, VertexOrder::Random, 2);
        let (near, order) = shape.in_spatial_order().unwrap();
        let mut seen: Vec<VertexId> = shape
            .connectivity()
            .vertices()
            .map(|v| order.old_id(v))
            .collect();
        assert!(
            seen.iter()
                .enumerate()
                .all(|(k, &v)| order.new_id(v).index() == k)
        );
        seen.sort_unstable();
        assert!(seen.iter().enumerate().all(|(k, v)| v.index() == k));
        assert_eq!(&order.scatter(near.positions()), shape.positions());
        let measure = |s: &Mesh<f64>| [volume(&s.surface()), surface_area(&s.surface())];
        for (a, b) in measure(&shape).into_iter().zip(measure(&near)) {
            assert!((a / b - 1.0).abs() < 1e-12);
        }
        let (_, old_faces) = order.faces(&faces(&shape));
        for f in near.connectivity().faces() {
            let old = shape.connectivity().triangle(old_faces[f.index()]);
            assert_eq!(
                near.connectivity().triangle(f).map(|v| order.old_id(v)),
                old
            );
        }
    }

    #[test]
    fn random_numbers_are_scattered_and_others_are_not() {
        let is_scattered =
            |s: &Mesh<f32>| SpatialOrder::is_scattered(s.positions().len(), &faces(s));
        for size in [5_000, 60_000] {
            let random = irregular(size, VertexOrder::Random, 4);
            assert!(is_scattered(&random));
            assert!(!is_scattered(&random.in_spatial_order().unwrap().0));
            assert!(!is_scattered(&irregular(size, VertexOrder::Natural, 4)));
        }
        assert!(!is_scattered(&irregular(1_000, VertexOrder::Random, 4)));
        assert!(!is_scattered(&icosphere(6)));
        assert!(!is_scattered(&creature(60)));
        assert!(!is_scattered(&torus(1.0, 0.3, 300, 100)));
    }

    #[test]
    fn neighbours_in_space_have_near_numbers() {
        let distance = |shape: &Mesh<f64>| {
            let mesh = shape.connectivity();
            let sum: f64 = mesh
                .edges()
                .map(|e| mesh.edge_vertices(e).map(|v| v.index()))
                .map(|[a, b]| a.abs_diff(b) as f64)
                .sum();
            sum / mesh.num_edges() as f64
        };
        let random = irregular::<f64>(40_000, VertexOrder::Random, 9);
        let near = random.in_spatial_order().unwrap().0;
        assert!(
            20.0 * distance(&near) < distance(&random),
            "{}",
            distance(&near)
        );
    }

    #[test]
    fn odd_places_have_an_order_too() {
        let order = |points: &[[f64; 3]]| {
            let positions: Positions<f64> = points.iter().map(|&p| Point3::from(p)).collect();
            let order = SpatialOrder::of(&positions);
            (0..points.len())
                .map(|k| order.old_id(VertexId::new(k)).index())
                .collect::<Vec<_>>()
        };
        assert!(order(&[]).is_empty());
        assert_eq!(order(&[[3.0; 3]; 3]), [0, 1, 2]);
        assert_eq!(order(&[[f64::MAX; 3], [-f64::MAX; 3]]).len(), 2);
        assert_eq!(order(&[[1.0; 3], [f64::NAN; 3], [0.0; 3]]).len(), 3);
        // Forty points in one cell of the upper bits, far from another point.
        let mut points: Vec<[f64; 3]> = (0..40)
            .map(|k| [1e-5 * f64::from(40 - k), 0.0, 0.0])
            .collect();
        points.push([1.0; 3]);
        let sorted: Vec<usize> = (0..40).rev().chain([40]).collect();
        assert_eq!(order(&points), sorted);
    }
}
