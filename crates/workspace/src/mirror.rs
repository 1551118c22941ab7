//! The plane across which selections, handles and brushes are mirrored.

use std::sync::Arc;

use cotan::geometry::Surface;
use cotan::halfedge::{VertexId, VertexMap};
use cotan::surface::{MirrorPlane, mirror_plane, nearest_corner};
use nalgebra::{Matrix4, Point3, Translation3, Unit, Vector3};
use serde::{Deserialize, Serialize};

use crate::plain;

/// A plane across which selections, handles and brushes are mirrored.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Mirror {
    /// A point of the plane.
    #[serde(with = "plain::vector")]
    pub point: Vector3<f64>,
    /// The normal, of any length but 0.
    #[serde(with = "plain::vector")]
    pub normal: Vector3<f64>,
}

/// The mirror image of each vertex, if it has one.
pub(crate) type Images = Arc<VertexMap<Option<VertexId>>>;

impl Mirror {
    /// The plane about which most of a surface is symmetric; `None` if it is not.
    pub(crate) fn of(surface: &Surface<'_, f64>) -> Option<Self> {
        let plane = mirror_plane(surface, TOLERANCE)?;
        Some(Self {
            point: plane.point.coords,
            normal: plane.normal.into_inner(),
        })
    }

    fn plane(&self) -> MirrorPlane {
        let normal = Unit::try_new(self.normal, 0.0).unwrap_or_else(Vector3::x_axis);
        MirrorPlane::new(Point3::from(self.point), normal)
    }

    /// Returns true if the plane is one: its numbers are finite, and the normal is not 0.
    pub(crate) fn is_valid(&self) -> bool {
        let size = self.normal.norm();
        let is_finite = self.point.iter().all(|x| x.is_finite());
        is_finite && size.is_finite() && size > 0.0
    }

    /// The mirror images of the vertices of a surface whose longest side is `side`.
    pub(crate) fn images(&self, surface: &Surface<'_, f64>, side: f64) -> Images {
        let points = self.plane().images(surface, REACH * side);
        let corner = points.map(|point| Some(nearest_corner(surface, point.as_ref()?)));
        Arc::new(corner)
    }

    /// The reflection as an affine map.
    pub(crate) fn reflection(&self) -> Matrix4<f64> {
        let normal = self.plane().normal.into_inner();
        let turn = nalgebra::Matrix3::identity() - normal * normal.transpose() * 2.0;
        let there = Translation3::from(self.point).to_homogeneous();
        let back = Translation3::from(-self.point).to_homogeneous();
        there * turn.to_homogeneous() * back
    }

    /// The rotation vector of the mirror image of a motion.
    pub(crate) fn turn(&self, turn: &Vector3<f64>) -> Vector3<f64> {
        // Axes are mirrored like those of screws: the one along the normal stays.
        let normal = self.plane().normal.into_inner();
        normal * (2.0 * normal.dot(turn)) - turn
    }
}

/// The mirror images of vertices, sorted and without duplicates.
pub(crate) fn images_of(vertices: &[VertexId], images: &Images) -> Vec<VertexId> {
    let found = vertices.iter().filter_map(|v| *images.get(*v)?);
    let mut found: Vec<VertexId> = found.collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// The deviation up to which a surface is symmetric, as a share of its diagonal.
const TOLERANCE: f64 = 0.005;

/// The distance up to which a vertex is the image of another, as a share of the longest side.
const REACH: f64 = 0.02;
