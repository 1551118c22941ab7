//! Isotropic remeshing: triangles of even size and shape on the same surface.
//!
//! Each round splits edges above 4/3 of the target length, collapses edges below 4/5 of it, flips
//! edges towards valence 6, moves vertices to the centre of their triangles within the tangent
//! plane, and projects them onto the original. Every other round shortens the target lengths where
//! the surfaces are too far apart.
//!
//! **Source**: M. Botsch, L. Kobbelt, "A remeshing approach to multiresolution modeling", SGP
//! 2004, section 4. Lengths adapted to the curvature: M. Dunyach et al., Eurographics 2013.
//! Deviations: the last rounds flip by angles instead of valences; no edit may turn a triangle
//! over; the nearest point is found by walking over the original.

mod distance;
mod edits;
mod options;
mod relax;
mod sizes;

use std::sync::OnceLock;

use cotan_geometry::{Mesh, Scalar, Surface, SurfacePoint, SurfaceTree};
use cotan_halfedge::VertexMap;
use nalgebra::{Point3, Vector3};

pub use options::{EdgeLengths, RemeshOptions};

use distance::Tree;

use crate::features::{Place, places};
use crate::nearest::{Nearest, walk};
use crate::tessellation_error::TessellationError;
use crate::triangles::{Triangles, permuted};
use crate::units::Units;

/// The result of [`remesh`].
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Remeshed<T: Scalar> {
    /// The new mesh.
    pub mesh: Mesh<T>,
    /// Per vertex of the new mesh: its place on the original, from which attributes are
    /// interpolated ([`crate::interpolated`]).
    pub places: VertexMap<SurfacePoint>,
}

/// Remeshes a surface with triangles of even size and shape.
///
/// Boundaries and the lines of [`RemeshOptions::features`] are kept: vertices on them move along
/// the line only, and vertices where lines end, branch or bend by more than 45 degrees stay at
/// their exact positions. Topology is kept.
///
/// # Errors
/// [`TessellationError`] for options out of range, and if the predicted size of the result is too
/// large.
///
/// ```
/// use cotan_surface::{RemeshOptions, remesh};
/// let mesh = cotan_geometry::torus::<f64>(1.0, 0.4, 60, 8);
/// let even = remesh(&mesh.surface(), &RemeshOptions::uniform(0.2))?;
/// assert!((even.mesh.surface().mean_edge_length() / 0.2 - 1.0).abs() < 0.1);
/// assert_eq!(even.mesh.connectivity().genus(), 1);
/// # Ok::<(), cotan_surface::TessellationError>(())
/// ```
pub fn remesh<T: Scalar>(
    surface: &Surface<'_, T>,
    options: &RemeshOptions,
) -> Result<Remeshed<T>, TessellationError> {
    let mut original = Triangles::new(surface)?;
    options.features.tag(surface, &mut original)?;
    let units = Units::of(surface);
    for p in &mut original.points {
        *p = units.inward(p);
    }
    let sizes = sizes::sizes(&original, options.lengths, units.scale)?;
    let tolerance = sizes::tolerance(options.lengths, units.scale);
    let most_faces = predicted_faces(&original, &sizes, options.max_memory)?;
    let mut remesher = Remesher::new(&original, &sizes, most_faces);
    for k in 0..options.iterations {
        if k % 2 == 1 {
            remesher.shorten_where_far(tolerance);
        }
        remesher.round();
        if k == 0 {
            remesher.reorder();
        }
    }
    if options.iterations > 0 {
        for _ in 0..DISTANCE_ROUNDS {
            if !remesher.shorten_where_far(tolerance) {
                break;
            }
            remesher.round();
        }
        for _ in 0..FINAL_ROUNDS {
            remesher.improve_slivers();
            remesher.flip_to_angles();
            remesher.relax();
        }
        remesher.flip_to_angles();
    }

    let positions = surface.positions().as_slice();
    let compacted = remesher.triangles.compact(|v, p| {
        let source = remesher.sources[v] as usize;
        match positions.get(source) {
            Some(old) if original.points[source] == p => *old,
            _ => Point3::from(units.outward(&p).map(T::of_f64)),
        }
    })?;
    let places = remesher.final_places(surface, &units, &compacted.old_vertex);
    Ok(Remeshed {
        mesh: compacted.mesh,
        places: VertexMap::from_vec(places),
    })
}

/// The maximum number of faces during the work, predicted from the area and the edges of each
/// triangle relative to its target length.
fn predicted_faces(
    original: &Triangles,
    sizes: &[f64],
    max_memory: Option<u64>,
) -> Result<usize, TessellationError> {
    let count = |f: usize| {
        let corners = original.corners(f as u32);
        let size = corners
            .iter()
            .fold(f64::INFINITY, |s, &v| s.min(sizes[v as usize]));
        let area = original.area_vector(f as u32).norm() / 2.0;
        let around: f64 = (0..3).map(|k| original.length(3 * f as u32 + k)).sum();
        1.0 + (area / (FACE_AREA * size * size)) + around / size
    };
    let predicted: f64 = cotan_parallel::Chunks::of(4096).sum(original.num_faces, count);
    let most = (u64::from(u32::MAX) / 12) as f64;
    let allowed = max_memory.map_or(most, |bytes| most.min(bytes as f64 / BYTES_PER_FACE));
    if predicted <= allowed {
        Ok((4.0 * predicted) as usize)
    } else {
        Err(TessellationError::TooLarge {
            faces: predicted as u64,
        })
    }
}

/// The state of a remeshing.
struct Remesher<'a> {
    original: &'a Triangles,
    original_places: Vec<Place>,
    /// Per vertex of the original.
    original_sizes: &'a [f64],
    /// Built for the first distance that a walk cannot settle.
    original_tree: OnceLock<Tree>,
    triangles: Triangles,
    places: Vec<Place>,
    /// Per vertex: a triangle of the original close to it.
    seeds: Vec<u32>,
    /// Per vertex: the target length.
    sizes: Vec<f64>,
    /// Per vertex: the target length relative to that of the original there, at most 1.
    shortening: Vec<f64>,
    /// Per vertex: its index in the original, or [`NONE`].
    sources: Vec<u32>,
    most_faces: usize,
}

impl<'a> Remesher<'a> {
    fn new(original: &'a Triangles, sizes: &'a [f64], most_faces: usize) -> Self {
        let places = places(original, BEND);
        Self {
            triangles: original.clone(),
            seeds: original.outgoing.iter().map(|h| h / 3).collect(),
            original_places: places.clone(),
            original_sizes: sizes,
            original_tree: OnceLock::new(),
            places,
            sizes: sizes.to_vec(),
            shortening: vec![1.0; sizes.len()],
            sources: (0..sizes.len() as u32).collect(),
            original,
            most_faces,
        }
    }

    /// The places of `vertices` on the original.
    ///
    /// A walk ends at a point that is nearest among its surroundings only. Vertices that it leaves
    /// away from their place are looked up among all triangles, and take that place if it faces
    /// the same way, so that none jumps to the other side of a thin part.
    fn final_places<T: Scalar>(
        &self,
        surface: &Surface<'_, T>,
        units: &Units,
        vertices: &[u32],
    ) -> Vec<SurfacePoint> {
        let walked = cotan_parallel::filled(vertices.len(), |i| self.place(vertices[i]));
        let is_away = |i: usize| {
            let size = self.sizes[vertices[i] as usize];
            walked[i].distance_squared > (AWAY * size).powi(2)
        };
        let away: Vec<usize> = (0..vertices.len()).filter(|&i| is_away(i)).collect();
        let mut places: Vec<_> = walked.iter().map(Nearest::on_surface).collect();
        if away.is_empty() {
            return places;
        }
        let tree = SurfaceTree::new(*surface);
        let found = cotan_parallel::filled(away.len(), |k| {
            let v = vertices[away[k]];
            let point = Point3::from(units.outward(&self.triangles.point(v)));
            let limit = walked[away[k]].distance_squared.sqrt() / units.scale;
            let closest = tree.closest_within(&point, limit)?;
            let there = self.original.area_vector(closest.on.face.index() as u32);
            let faces = self.triangles.ring(v).map(|h| h / 3);
            let here: Vector3<f64> = faces.map(|f| self.triangles.area_vector(f)).sum();
            (here.dot(&there) >= 0.0).then_some(closest.on)
        });
        for (i, place) in away.into_iter().zip(found) {
            places[i] = place.unwrap_or(places[i]);
        }
        places
    }

    /// The nearest point of the original that walks from the seeds of `v` and of its neighbours
    /// reach: a vertex that was never moved, such as a new one between others, has the seed of
    /// one of them only.
    fn place(&self, v: u32) -> Nearest {
        let point = self.triangles.point(v);
        let from = |w: u32| walk(self.original, self.seeds[w as usize], point);
        let mut best = from(v);
        for h in self.triangles.edges_at(v) {
            if best.distance_squared == 0.0 {
                break;
            }
            let other = from(self.triangles.origin(h) + self.triangles.target(h) - v);
            if other.distance_squared < best.distance_squared {
                best = other;
            }
        }
        best
    }

    /// One round of all edits.
    fn round(&mut self) {
        self.split_long();
        self.collapse_short();
        self.flip_to_valence();
        self.relax();
    }

    /// Sorts the elements so that neighbours are close together in memory.
    fn reorder(&mut self) {
        let old = self.triangles.reorder();
        self.places = permuted(&self.places, &old);
        for values in [&mut self.sizes, &mut self.shortening] {
            *values = permuted(values, &old);
        }
        for ids in [&mut self.seeds, &mut self.sources] {
            *ids = permuted(ids, &old);
        }
    }

    /// The target length of the edge of `h`.
    #[inline]
    fn target(&self, h: u32) -> f64 {
        let [a, b] = [self.triangles.origin(h), self.triangles.target(h)];
        self.sizes[a as usize].min(self.sizes[b as usize])
    }

    /// The normal of a new triangle, or zero.
    fn area_vector(a: Vector3<f64>, b: Vector3<f64>, c: Vector3<f64>) -> Vector3<f64> {
        (b - a).cross(&(c - a))
    }
}

/// The area of an equilateral triangle with sides of length 1.
const FACE_AREA: f64 = 0.433;

/// Bytes per predicted face at the peak: the structure and the new mesh, with room for the growth
/// of vectors.
const BYTES_PER_FACE: f64 = 400.0;

/// The angle, in radians, by which a line turns at a corner.
const BEND: f64 = std::f64::consts::FRAC_PI_4;

/// The share of the target length by which a vertex is away from its place.
const AWAY: f64 = 1e-6;

/// The most rounds after the others while the surfaces are too far apart.
const DISTANCE_ROUNDS: usize = 3;

/// Rounds that improve angles at the end.
const FINAL_ROUNDS: usize = 4;
