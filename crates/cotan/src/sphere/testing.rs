//! Sphere maps for the tests of this module.

use cotan_geometry::Shape;
use nalgebra::{Point3, Vector3};

use super::error::SphereError;
use super::map::SphereMap;
use super::moebius;

/// The unit sphere with all but a share `rest` of it pressed towards `axis` by a Möbius map.
pub(crate) fn squeezed<'m>(
    shape: &'m Shape<f64>,
    axis: &Vector3<f64>,
    rest: f64,
) -> Result<SphereMap<'m, f64>, SphereError> {
    let mut points: Vec<Vector3<f64>> = shape.positions.values().map(|p| p.coords).collect();
    moebius::apply(&mut points, &(axis * (1.0 - rest)));
    SphereMap::new(&shape.mesh, points.into_iter().map(Point3::from).collect())
}
