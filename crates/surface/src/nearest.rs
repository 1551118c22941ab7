//! The nearest point of the original surface, found by walking from a triangle close by.
//!
//! A vertex that remeshing moves stays on its own sheet of a thin part, where a search through
//! space could jump to the other side.

use cotan_geometry::{Mesh, Positions, Scalar, Surface, SurfacePoint, closest_on_triangle};
use cotan_halfedge::{FaceId, FaceMap, HalfedgeMesh, VertexId, VertexMap};
use nalgebra::Vector3;

use crate::features::Place;
use crate::tessellation_error::TessellationError;
use crate::triangles::{NONE, Triangles};

/// The values at points of a surface of a quantity per vertex.
///
/// **Shapes**: `values` has an entry per vertex of the surface's mesh.
pub fn interpolated<T: Scalar>(
    mesh: &HalfedgeMesh,
    points: &VertexMap<SurfacePoint>,
    values: &VertexMap<T>,
) -> VertexMap<T> {
    points.map(|point| {
        let weights = point.barycentric.map(T::of_f64);
        let [a, b, c] = mesh.triangle(point.face).map(|v| values[v]);
        a * weights[0] + b * weights[1] + c * weights[2]
    })
}

/// The nearest point of a surface for each of some positions, of which a close vertex of the
/// surface is known, such as those of [`crate::Decimated`] with its sources.
///
/// # Errors
/// [`TessellationError`] if there are not as many vertices as positions, or a vertex is out of
/// range.
pub fn places_near<T: Scalar>(
    surface: &Surface<'_, T>,
    positions: &Positions<T>,
    vertices: &VertexMap<VertexId>,
) -> Result<VertexMap<SurfacePoint>, TessellationError> {
    let original = Triangles::new(surface)?;
    let is_known = |v: &VertexId| v.index() < original.outgoing.len();
    if positions.len() != vertices.len() || !vertices.values().all(is_known) {
        return Err(TessellationError::Length {
            name: "close vertices",
            entries: vertices.len(),
            elements: positions.len(),
        });
    }
    let places = cotan_parallel::filled(positions.len(), |i| {
        let v = VertexId::new(i);
        let face = original.outgoing[vertices[v].index()] / 3;
        walk(&original, face, positions[v].coords.map(T::as_f64)).on_surface()
    });
    Ok(VertexMap::from_vec(places))
}

/// For each corner of a new mesh, the place of its vertex on the original, on the side of the
/// corner's face. Along a seam of texture coordinates the corners of a vertex differ.
///
/// **Shapes**: `places` has an entry per vertex of `mesh`. The corners of a face are in the order
/// of [`HalfedgeMesh::triangle`].
///
/// # Errors
/// [`TessellationError`] if there are not as many places as vertices, or a place is out of range.
pub fn corner_places<T: Scalar>(
    surface: &Surface<'_, T>,
    mesh: &Mesh<T>,
    places: &VertexMap<SurfacePoint>,
) -> Result<FaceMap<[SurfacePoint; 3]>, TessellationError> {
    let original = Triangles::new(surface)?;
    let is_known = |place: &SurfacePoint| place.face.index() < original.num_faces;
    if places.len() != mesh.num_vertices() || !places.values().all(is_known) {
        return Err(TessellationError::Length {
            name: "places",
            entries: places.len(),
            elements: mesh.num_vertices(),
        });
    }
    let corners = cotan_parallel::filled(mesh.num_faces(), |f| {
        let corners = mesh.connectivity().triangle(FaceId::new(f));
        let points = corners.map(|v| mesh.positions()[v].coords.map(T::as_f64));
        let center = (points[0] + points[1] + points[2]) / 3.0;
        [0, 1, 2].map(|k| {
            let start = places[corners[k]].face.index() as u32;
            let inside = points[k] + (center - points[k]) * NUDGE;
            let face = walk(&original, start, inside).face;
            on_triangle(&original, face, points[k]).on_surface()
        })
    });
    Ok(FaceMap::from_vec(corners))
}

/// A nearest point while walking.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub(crate) face: u32,
    pub(crate) point: Vector3<f64>,
    pub(crate) barycentric: [f64; 3],
    pub(crate) distance_squared: f64,
}

impl Nearest {
    pub(crate) fn on_surface(&self) -> SurfacePoint {
        SurfacePoint {
            face: FaceId::new(self.face as usize),
            barycentric: self.barycentric,
        }
    }
}

/// Walks from `face` to a triangle nearest to `point`: while the nearest point of the current one
/// is on its border, to a nearer triangle beyond that edge or around that corner. Of the triangles
/// around a point inside an edge there is only one other, so the walk ends where no way along the
/// surface is nearer.
pub(crate) fn walk(original: &Triangles, face: u32, point: Vector3<f64>) -> Nearest {
    walk_within(original, face, point, 0.0)
}

/// As [`walk`], but stops at the first triangle that is no farther than `distance`.
pub(crate) fn walk_within(
    original: &Triangles,
    face: u32,
    point: Vector3<f64>,
    distance: f64,
) -> Nearest {
    let enough = distance * distance;
    let mut best = on_triangle(original, face, point);
    for _ in 0..MAX_STEPS {
        if best.distance_squared <= enough {
            break;
        }
        let start = best.face;
        let nearer = |face: u32, best: Nearest| {
            let other = on_triangle(original, face, point);
            if other.distance_squared < best.distance_squared {
                other
            } else {
                best
            }
        };
        // The corner opposite to side k, which begins at corner k, is the one before it.
        let corner = (0..3).find(|&k| best.barycentric[k] == 1.0);
        let side = (0..3).find(|&k| best.barycentric[(k + 2) % 3] == 0.0);
        if let Some(k) = corner {
            let v = original.corners(start)[k];
            for h in original.ring(v).filter(|h| h / 3 != start) {
                best = nearer(h / 3, best);
            }
        } else if let Some(k) = side {
            let twin = original.twin(3 * start + k as u32);
            if twin != NONE {
                best = nearer(twin / 3, best);
            }
        }
        if best.face == start {
            break;
        }
    }
    best
}

/// Walks along a line of `original` from the edge of `h` to the point nearest to `point`, not
/// beyond corners. Returns the edge and the point.
pub(crate) fn walk_line(
    original: &Triangles,
    places: &[Place],
    h: u32,
    point: Vector3<f64>,
) -> (u32, Vector3<f64>) {
    let mut best = (h, on_segment(original, h, point));
    for _ in 0..MAX_STEPS {
        let start = best.0;
        for v in [original.origin(start), original.target(start)] {
            if places[v as usize] != Place::Line {
                continue;
            }
            for other in original.edges_at(v).filter(|&g| original.tag(g) != NONE) {
                let near = on_segment(original, other, point);
                if (near - point).norm_squared() < (best.1 - point).norm_squared() {
                    best = (original.edge_of(other), near);
                }
            }
        }
        if best.0 == start {
            break;
        }
    }
    best
}

fn on_segment(original: &Triangles, h: u32, p: Vector3<f64>) -> Vector3<f64> {
    let (a, b) = (
        original.point(original.origin(h)),
        original.point(original.target(h)),
    );
    let along = b - a;
    let length_squared = along.norm_squared();
    if length_squared > 0.0 {
        a + along * ((p - a).dot(&along) / length_squared).clamp(0.0, 1.0)
    } else {
        a
    }
}

fn on_triangle(original: &Triangles, face: u32, p: Vector3<f64>) -> Nearest {
    let corners = original.corners(face).map(|v| original.point(v).into());
    let (barycentric, point) = closest_on_triangle(&p.into(), &corners);
    Nearest {
        face,
        point: point.coords,
        barycentric,
        distance_squared: (p - point.coords).norm_squared(),
    }
}

/// The share of the way from a corner to the centre of its face at which the side of a seam is
/// found.
const NUDGE: f64 = 0.01;

/// Each step of a walk is strictly nearer, so it ends; this bound is for rounding.
const MAX_STEPS: usize = 10_000;
