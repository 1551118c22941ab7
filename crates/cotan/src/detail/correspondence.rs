//! Corresponding points of two surfaces.

use cotan_geometry::{Positions, Scalar, Surface, SurfacePoint, SurfaceTree};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use nalgebra::{Point3, Vector3};

use super::base::BaseSurface;
use super::error::DetailError;
use crate::merge::Similarity;
use crate::smooth::Mask;
use crate::sphere::{SphereError, SphereMap};

/// A point of a triangle: its corners, and their weights.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CorrespondingPoint {
    /// The corners.
    pub corners: [VertexId; 3],
    /// Their weights, at least 0, with the sum 1.
    pub weights: [f64; 3],
}

impl CorrespondingPoint {
    fn of(mesh: &HalfedgeMesh, point: &SurfacePoint) -> Self {
        Self {
            corners: mesh.triangle(point.face),
            weights: point.barycentric,
        }
    }
}

/// For each vertex of a target the corresponding point of a source, if there is one.
///
/// The points come from two maps to the sphere, from closest points, or from elsewhere.
#[derive(Clone, PartialEq, Debug)]
pub struct Correspondence {
    points: VertexMap<Option<CorrespondingPoint>>,
    num_source_vertices: usize,
}

impl Correspondence {
    /// Corresponding points from elsewhere, one per vertex of the target.
    ///
    /// # Errors
    /// [`DetailError::NotAPoint`] for a corner that does not exist, and for weights that are
    /// negative or whose sum is not 1 to six digits. The sum is then made exact.
    pub fn new(
        num_source_vertices: usize,
        mut points: VertexMap<Option<CorrespondingPoint>>,
    ) -> Result<Self, DetailError> {
        for (vertex, point) in points.iter_mut() {
            let Some(point) = point else { continue };
            let sum: f64 = point.weights.iter().sum();
            let exists = |v: &VertexId| v.index() < num_source_vertices;
            let is_point = point.corners.iter().all(exists)
                && point.weights.iter().all(|w| *w >= 0.0)
                && (sum - 1.0).abs() < 1e-6;
            if !is_point {
                return Err(DetailError::NotAPoint { vertex });
            }
            point.weights = point.weights.map(|w| w / sum);
        }
        Ok(Self {
            points,
            num_source_vertices,
        })
    }

    /// The points at the same places of the sphere.
    ///
    /// # Errors
    /// [`SphereError`] if a direction is not finite.
    pub fn on_sphere<T: Scalar>(
        source: &SphereMap<T>,
        target: &SphereMap<T>,
    ) -> Result<Self, SphereError> {
        let places = source.point_location().locate_all(target.positions())?;
        let points = places.iter().map(|place| {
            Some(CorrespondingPoint {
                corners: source.mesh().triangle(place.face),
                weights: place.barycentric.map(T::as_f64),
            })
        });
        Ok(Self {
            points: points.collect(),
            num_source_vertices: source.mesh().num_vertices(),
        })
    }

    /// The closest points of the source's base, which is moved by `placed` first, to the vertices
    /// of the target's base.
    ///
    /// A vertex has no counterpart if the closest point is farther than a tenth of the square root
    /// of the target's area, faces another way, or lies at a rim beside it.
    #[must_use]
    pub fn closest<T: Scalar>(
        source: &BaseSurface<T>,
        target: &BaseSurface<T>,
        placed: &Similarity,
    ) -> Self {
        let mesh = source.base().mesh();
        let moved = source.base().positions().map(|p| placed.apply(p));
        let tree = SurfaceTree::new(Surface::assume_checked(mesh, &moved));
        let reach = REACH * target.unit();
        let is_rim: VertexMap<bool> =
            VertexMap::from_fn(mesh.num_vertices(), |v| mesh.is_boundary_vertex(v));
        let edge = source.mean_edge() * source.unit() * placed.scale;
        let base = target.base();
        let vertices: Vec<VertexId> = base.mesh().vertices().collect();
        let found = cotan_parallel::Chunks::of(64).filled(vertices.len(), |i| {
            let v = vertices[i];
            let closest = tree.closest_within(&base.position(v), reach)?;
            let point = CorrespondingPoint::of(mesh, &closest.on);
            let normal = interpolate(&point, source.normals(), Vector3::zeros());
            let normal = placed.rotation * normal;
            let aside = base.position(v) - closest.position;
            let aside = aside - normal * aside.dot(&normal) / normal.norm_squared();
            let on_rim = (0..3).all(|k| point.weights[k] == 0.0 || is_rim[point.corners[k]]);
            let is_beside = on_rim && aside.norm() > 0.5 * edge;
            let is_same_side = normal.dot(&target.normals()[v]) > 0.0;
            (is_same_side && !is_beside).then_some(point)
        });
        Self {
            points: VertexMap::from_vec(found),
            num_source_vertices: mesh.num_vertices(),
        }
    }

    /// The corresponding points.
    pub fn points(&self) -> &VertexMap<Option<CorrespondingPoint>> {
        &self.points
    }

    pub(super) fn check(&self, found: [usize; 2]) -> Result<(), DetailError> {
        let expected = [self.num_source_vertices, self.points.len()];
        if expected != found {
            return Err(DetailError::OtherMeshes { expected, found });
        }
        match self.points.values().any(Option::is_some) {
            true => Ok(()),
            false => Err(DetailError::NothingCovered),
        }
    }

    /// A field of the source at the corresponding points, 0 without one.
    pub(super) fn interpolate(&self, field: &VertexMap<f64>) -> VertexMap<f64> {
        let value = |point: &Option<CorrespondingPoint>| {
            point.as_ref().map_or(0.0, |p| interpolate(p, field, 0.0))
        };
        self.points.map(value)
    }

    /// The places of the corresponding points on the source's base.
    pub(super) fn places(&self, base: &Positions<f64>) -> VertexMap<Option<Point3<f64>>> {
        let place = |point: &CorrespondingPoint| {
            let terms = (0..3).map(|k| base[point.corners[k]].coords * point.weights[k]);
            Point3::from(terms.sum::<Vector3<f64>>())
        };
        self.points.map(|point| point.as_ref().map(place))
    }

    /// Weights that fall to 0 towards the vertices without counterpart; `None` if all have one.
    pub(super) fn soft_border<T: Scalar>(
        &self,
        target: &BaseSurface<T>,
        falloff: f64,
    ) -> Result<Option<Mask>, DetailError> {
        let covered = self.points.iter().filter(|(_, point)| point.is_some());
        let covered: Vec<VertexId> = covered.map(|(v, _)| v).collect();
        if covered.len() == self.points.len() {
            return Ok(None);
        }
        let mask = Mask::inside(&target.base(), &covered, falloff * target.unit())?;
        Ok(Some(mask))
    }
}

/// The value of a field at a point.
fn interpolate<A>(point: &CorrespondingPoint, field: &VertexMap<A>, zero: A) -> A
where
    A: Copy + std::ops::Mul<f64, Output = A> + std::ops::Add<Output = A>,
{
    let terms = (0..3).map(|k| field[point.corners[k]] * point.weights[k]);
    terms.fold(zero, |sum, term| sum + term)
}

/// The largest distance of a counterpart from a vertex, in square roots of the target's area.
const REACH: f64 = 0.1;
