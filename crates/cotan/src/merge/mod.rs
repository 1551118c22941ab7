//! Merging: parts of two surfaces become one, without a seam.
//!
//! [`merge`] keeps whole faces of both surfaces, joins the cuts by a strip of triangles or, across
//! wider gaps, by rings of them, and smooths the seam by the flow: the surface there gets the mean
//! curvatures of both inputs, and between them a field that is harmonic. Everything farther from
//! the seam than [`MergeOptions::band`] stays bit for bit as it was.
//!
//! | module | purpose |
//! |---|---|
//! | `cut` | the kept faces of a surface and the loops around them |
//! | `pairs` | the pairs of loops that are joined |
//! | `place`, `several` | the motion of the second surface, by one loop or several |
//! | `bridge`, `valleys`, `zipper` | the faces between two loops |
//! | `blend` | the flow along the seam |
//! | `report` | measures |
//!
//! **Source**: paper, section 4 (mesh merging). The strip, the rest shape of the seam and the
//! filled curvatures are ours.

mod blend;
mod bridge;
mod cut;
mod error;
mod options;
mod pairs;
mod place;
mod report;
mod several;
mod valleys;
mod zipper;

#[cfg(test)]
mod tests;

use std::collections::HashSet;

use cotan_geometry::{Mesh, Positions, Scalar, Surface};
use cotan_halfedge::{FaceId, FaceMap, VertexId, VertexMap};
use nalgebra::{Point3, Vector3};

pub use error::{Input, MergeError};
pub use options::{MergeOptions, Placement};
pub use place::Similarity;
pub use report::SeamReport;

use blend::{Seam, rings_around};
use bridge::{Bridge, Side};
use cut::Part;

use crate::outward::inside_out;
use crate::smooth::mollified_curvature_field;

/// The origin of a vertex of a merged mesh.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum VertexOrigin {
    /// A vertex of the first mesh.
    A(VertexId),
    /// A vertex of the second mesh.
    B(VertexId),
    /// A vertex between the two.
    Seam,
}

/// The origin of a face of a merged mesh.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FaceOrigin {
    /// A face of the first mesh.
    A(FaceId),
    /// A face of the second mesh.
    B(FaceId),
    /// A face between the two.
    Seam,
}

/// Two surfaces in one.
#[derive(Clone, Debug)]
pub struct Merged<T: Scalar> {
    /// The surface: vertices and faces of the first mesh in their order, then those of the second,
    /// then those of the seam.
    pub mesh: Mesh<T>,
    /// The origin of each vertex.
    pub vertices: VertexMap<VertexOrigin>,
    /// The origin of each face.
    pub faces: FaceMap<FaceOrigin>,
    /// The motion of the second mesh.
    pub placed: Similarity,
    /// Measures.
    pub report: SeamReport,
}

/// The faces all of whose corners are selected.
///
/// **Shapes**: one entry per face.
///
/// # Panics
/// If `selected` does not have one entry per vertex.
pub fn faces_within<T: Scalar>(
    surface: &Surface<'_, T>,
    selected: &VertexMap<bool>,
) -> FaceMap<bool> {
    let mesh = surface.mesh();
    assert_eq!(selected.len(), mesh.num_vertices(), "one entry per vertex");
    FaceMap::from_fn(mesh.num_faces(), |f| {
        mesh.face_vertices(f).all(|v| selected[v])
    })
}

/// Joins parts of two surfaces.
///
/// **Shapes**: `keep_a` and `keep_b` have one entry per face of `a` and `b`.
///
/// ```
/// use cotan::geometry::shapes::icosphere;
/// use cotan::merge::{MergeOptions, faces_within, merge};
///
/// // The lower half of one sphere, the upper half of another that is turned.
/// let a = icosphere::<f64>(4);
/// let turn = nalgebra::Rotation3::new(nalgebra::Vector3::new(0.3, 0.2, 0.5));
/// let b = a.with_positions(a.positions().map(|p| turn * p))?;
/// let below = faces_within(&a.surface(), &a.positions().map(|p| p.z < -0.05));
/// let above = faces_within(&b.surface(), &b.positions().map(|p| p.z > 0.05));
/// let merged = merge(&a, &below, &b, &above, &MergeOptions::default())?;
/// assert!(merged.mesh.connectivity().is_closed());
/// assert!(merged.mesh.positions().values().all(|p| (p.coords.norm() - 1.0).abs() < 0.01));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`MergeError`]: selections that keep or cut nothing or that cut into a boundary, surfaces that
/// are inside out, cuts that do not correspond, and the errors of the flow.
pub fn merge<'m, T: Scalar>(
    a: impl Into<Surface<'m, T>>,
    keep_a: &FaceMap<bool>,
    b: impl Into<Surface<'m, T>>,
    keep_b: &FaceMap<bool>,
    options: &MergeOptions,
) -> Result<Merged<T>, MergeError> {
    let (a, b) = (a.into(), b.into());
    check_outward(&a, Input::A)?;
    check_outward(&b, Input::B)?;
    let parts = [
        Part::cut(&a, keep_a, Input::A)?,
        Part::cut(&b, keep_b, Input::B)?,
    ];
    let placed = placement(&a, &b, &parts, options)?;
    let moved;
    let b = if placed == Similarity::identity() {
        b
    } else {
        moved = b
            .positions()
            .map(|p| placed.apply(&p.map(T::as_f64)).map(T::of_f64));
        b.with_positions(&moved)
    };
    let inputs = [a, b];
    let joined = Joined::new(&inputs, &parts, options)?;
    joined.blended(&inputs, &parts, placed, options)
}

/// Checks that no closed component has a negative volume.
fn check_outward<T: Scalar>(surface: &Surface<'_, T>, input: Input) -> Result<(), MergeError> {
    let is_inside_out = inside_out(surface);
    let first = is_inside_out.iter().find(|(_, inside_out)| **inside_out);
    match first {
        Some((vertex, _)) => Err(MergeError::InsideOut { input, vertex }),
        None => Ok(()),
    }
}

/// The motion of the second surface.
fn placement<T: Scalar>(
    a: &Surface<'_, T>,
    b: &Surface<'_, T>,
    parts: &[Part; 2],
    options: &MergeOptions,
) -> Result<Similarity, MergeError> {
    for &[of_a, of_b] in &options.landmarks {
        for (input, vertex, surface) in [(Input::A, of_a, a), (Input::B, of_b, b)] {
            if vertex.index() >= surface.mesh().num_vertices() {
                return Err(MergeError::LandmarkOutOfRange { input, vertex });
            }
        }
    }
    if options.placement == Placement::AsIs {
        return Ok(Similarity::identity());
    }
    if options.landmarks.len() >= 3 {
        let pairs = options
            .landmarks
            .iter()
            .map(|&[of_a, of_b]| [b.position(of_b), a.position(of_a)].map(|p| p.map(T::as_f64)));
        return Ok(Similarity::between(&pairs.collect::<Vec<_>>()));
    }
    match [&parts[0].loops[..], &parts[1].loops[..]] {
        [[still], [moving]] => {
            let (still, moving) = (points(a, still), points(b, moving));
            let gap = place::perimeter(&still) / still.len() as f64;
            Ok(Similarity::between_loops(&still, &moving, gap))
        }
        [still, moving] if still.len() == moving.len() => {
            let loops = |surface, loops: &[Vec<VertexId>]| {
                let points = loops.iter().map(|vertices| points(surface, vertices));
                points.collect::<Vec<_>>()
            };
            let (of_a, of_b) = (loops(a, still), loops(b, moving));
            let edges: usize = of_a.iter().map(Vec::len).sum();
            let gap = of_a.iter().map(|p| place::perimeter(p)).sum::<f64>() / edges as f64;
            several::between_several(&of_a, &of_b, &options.loops, gap)
                .ok_or(MergeError::Landmarks { loops: still.len() })
        }
        [still, moving] => Err(MergeError::UnequalLoops {
            loops: [still.len(), moving.len()],
        }),
    }
}

fn points<T: Scalar>(surface: &Surface<'_, T>, vertices: &[VertexId]) -> Vec<Point3<f64>> {
    let place = |&v: &VertexId| surface.position(v).map(T::as_f64);
    vertices.iter().map(place).collect()
}

/// Both parts and the faces between them, before the seam is smoothed.
struct Joined<T: Scalar> {
    mesh: Mesh<T>,
    vertices: VertexMap<VertexOrigin>,
    faces: FaceMap<FaceOrigin>,
    /// The vertices along the cuts and between them.
    seam: Vec<VertexId>,
}

impl<T: Scalar> Joined<T> {
    fn new(
        inputs: &[Surface<'_, T>; 2],
        parts: &[Part; 2],
        options: &MergeOptions,
    ) -> Result<Self, MergeError> {
        let mut positions: Vec<Point3<T>> = Vec::new();
        let mut vertices = Vec::new();
        let mut faces: Vec<[u32; 3]> = Vec::new();
        let mut origins = Vec::new();
        let mut of_input = [0, 1].map(|k| vec![u32::MAX; inputs[k].mesh().num_vertices()]);
        for k in 0..2 {
            let mesh = inputs[k].mesh();
            let mut is_used = vec![false; mesh.num_vertices()];
            for &f in &parts[k].faces {
                for v in mesh.triangle(f) {
                    is_used[v.index()] = true;
                }
            }
            for v in mesh.vertices().filter(|v| is_used[v.index()]) {
                of_input[k][v.index()] = positions.len() as u32;
                positions.push(inputs[k].position(v));
                vertices.push(match k {
                    0 => VertexOrigin::A(v),
                    _ => VertexOrigin::B(v),
                });
            }
            for &f in &parts[k].faces {
                faces.push(mesh.triangle(f).map(|v| of_input[k][v.index()]));
                origins.push(match k {
                    0 => FaceOrigin::A(f),
                    _ => FaceOrigin::B(f),
                });
            }
        }
        let loops = [0, 1].map(|k| {
            let loops = parts[k].loops.iter();
            loops
                .map(|vertices| points(&inputs[k], vertices))
                .collect::<Vec<_>>()
        });
        let landmarks: Vec<_> = options
            .landmarks
            .iter()
            .map(|pair| [0, 1].map(|k| inputs[k].position(pair[k]).map(T::as_f64)))
            .collect();
        let partners = pairs::pair(&loops[0], &loops[1], &landmarks, options)?;
        // The edges of the kept faces.
        let mut edges: HashSet<[u32; 2]> = HashSet::new();
        for &[a, b, c] in &faces {
            edges.extend([[a, b], [b, c], [c, a]].map(|[p, q]| [p.min(q), p.max(q)]));
        }
        let mut seam = Vec::new();
        for (first, &second) in partners.iter().enumerate() {
            let chosen = [first, second];
            let lengths = [0, 1].map(|k| place::perimeter(&loops[k][chosen[k]]));
            if !(lengths[0] <= MAX_RATIO * lengths[1] && lengths[1] <= MAX_RATIO * lengths[0]) {
                return Err(MergeError::Perimeters {
                    pair: first,
                    lengths,
                });
            }
            let side = |k: usize| {
                let cut = &parts[k].loops[chosen[k]];
                Side {
                    vertices: cut.iter().map(|v| of_input[k][v.index()]).collect(),
                    points: loops[k][chosen[k]].clone(),
                    outward: outward(&inputs[k], cut),
                }
            };
            let (still, mut moving) = (side(0), side(1));
            // The second loop runs against the first.
            moving.vertices.reverse();
            moving.points.reverse();
            moving.outward.reverse();
            let is_edge = |a: u32, b: u32| edges.contains(&[a.min(b), a.max(b)]);
            let bridge = Bridge::between(&still, &moving, positions.len() as u32, is_edge);
            seam.extend(still.vertices.iter().chain(&moving.vertices));
            seam.extend((positions.len() as u32..).take(bridge.points.len()));
            vertices.resize(vertices.len() + bridge.points.len(), VertexOrigin::Seam);
            positions.extend(bridge.points.iter().map(|p| p.map(T::of_f64)));
            origins.resize(origins.len() + bridge.faces.len(), FaceOrigin::Seam);
            faces.extend(bridge.faces);
        }
        let coordinates: Vec<[T; 3]> = positions.iter().map(|p| [p.x, p.y, p.z]).collect();
        let indices: Vec<u32> = faces.into_iter().flatten().collect();
        Ok(Self {
            mesh: Mesh::from_triangles(&coordinates, &indices)?,
            vertices: VertexMap::from_vec(vertices),
            faces: FaceMap::from_vec(origins),
            seam: seam
                .into_iter()
                .map(|v| VertexId::new(v as usize))
                .collect(),
        })
    }

    /// Smooths the seam and measures it.
    fn blended(
        self,
        inputs: &[Surface<'_, T>; 2],
        parts: &[Part; 2],
        placed: Similarity,
        options: &MergeOptions,
    ) -> Result<Merged<T>, MergeError> {
        let rings = rings_around(self.mesh.connectivity(), &self.seam);
        let own = [0, 1].map(|k| mollified_curvature_field(&inputs[k]));
        let curvatures = self.vertices.map(|origin| match *origin {
            VertexOrigin::A(v) => own[0][v],
            VertexOrigin::B(v) => own[1][v],
            VertexOrigin::Seam => 0.0,
        });
        let seam = Seam {
            mesh: &self.mesh,
            rings: &rings,
            curvatures: &curvatures,
        };
        let positions = seam.blend(options)?;
        let report = self.report(inputs, parts, &rings, &positions, options);
        let (connectivity, _) = self.mesh.into_parts();
        let mesh = Mesh::new(connectivity, positions).map_err(crate::Error::from)?;
        Ok(Merged {
            mesh,
            vertices: self.vertices,
            faces: self.faces,
            placed,
            report,
        })
    }

    fn report(
        &self,
        inputs: &[Surface<'_, T>; 2],
        parts: &[Part; 2],
        rings: &VertexMap<usize>,
        positions: &Positions<T>,
        options: &MergeOptions,
    ) -> SeamReport {
        let before = self.mesh.surface();
        let after = before.with_positions(positions);
        let mesh = self.mesh.connectivity();
        let is_near = |e| {
            let [p, q] = mesh.edge_vertices(e);
            rings[p].min(rings[q]) <= options.band
        };
        let on_seam = |e| mesh.edge_vertices(e).iter().all(|&v| rings[v] == 0);
        let is_kept = |corners: [VertexId; 3]| {
            let origins = corners.map(|v| self.vertices[v]);
            let of_a = origins.iter().all(|o| matches!(o, VertexOrigin::A(_)));
            let of_b = origins.iter().all(|o| matches!(o, VertexOrigin::B(_)));
            of_a || of_b
        };
        let alone = [0, 1].map(|k| {
            let mut is_kept = vec![false; inputs[k].mesh().num_faces()];
            parts[k]
                .faces
                .iter()
                .for_each(|f| is_kept[f.index()] = true);
            let faces = inputs[k].self_intersections();
            faces.iter().filter(|f| is_kept[f.index()]).count()
        });
        let is_moved = |v: VertexId| {
            self.vertices[v] != VertexOrigin::Seam && before.position(v) != after.position(v)
        };
        let count = |origin| self.faces.values().filter(|&&f| f == origin).count();
        SeamReport {
            loops: parts[0].loops.len(),
            faces: count(FaceOrigin::Seam),
            vertices: self
                .vertices
                .values()
                .filter(|&&v| v == VertexOrigin::Seam)
                .count(),
            dropped: [parts[0].dropped, parts[1].dropped],
            moved: mesh.vertices().filter(|&v| is_moved(v)).count(),
            dihedral: report::dihedral(&after, on_seam),
            dihedral_elsewhere: report::dihedral(&after, |e| !is_near(e)),
            smallest_angle: [
                report::smallest_angle(&after, rings, options.band, |_| true),
                report::smallest_angle(&before, rings, options.band, is_kept),
            ],
            self_intersections: [after.self_intersections().len(), alone[0] + alone[1]],
        }
    }
}

/// The directions in which a surface continues beyond its cut: unit vectors in the planes of the
/// faces there, across the cut.
fn outward<T: Scalar>(surface: &Surface<'_, T>, cut: &[VertexId]) -> Vec<Vector3<f64>> {
    let mesh = surface.mesh();
    let count = cut.len();
    let of_edge: Vec<Vector3<f64>> = (0..count)
        .map(|k| {
            let [from, to] = [cut[k], cut[(k + 1) % count]];
            let Some(face) = mesh.halfedge_between(from, to).and_then(|h| mesh.face(h)) else {
                return Vector3::zeros();
            };
            let along = (surface.position(to) - surface.position(from)).map(T::as_f64);
            along.cross(&surface.face_normal(face).map(T::as_f64))
        })
        .collect();
    (0..count)
        .map(|k| {
            let sum = of_edge[k] + of_edge[(k + count - 1) % count];
            sum.try_normalize(0.0).unwrap_or_else(Vector3::zeros)
        })
        .collect()
}

/// Two cuts that differ more in length are not joined.
const MAX_RATIO: f64 = 2.0;
