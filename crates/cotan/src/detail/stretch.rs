//! The distortion of a correspondence.

use cotan_geometry::Scalar;
use cotan_halfedge::{VertexId, VertexMap};
use nalgebra::{Matrix2, Point3, Vector2, Vector3};

use super::base::BaseSurface;
use super::correspondence::Correspondence;
use super::error::DetailError;

/// Measures of the map from a target to a source.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct Stretch {
    /// The share of the target's area whose faces have counterparts at all corners.
    pub coverage: f64,
    /// The stretch of a face is the larger of σ₁ and 1/σ₂, the singular values of the map of the
    /// face to the source, with both surfaces scaled to the area 1. This is its median by area.
    pub median: f64,
    /// The value that is exceeded on a twentieth of the covered area.
    pub most: f64,
}

impl Stretch {
    /// Measures a correspondence.
    ///
    /// # Errors
    /// [`DetailError::OtherMeshes`] for other meshes, [`DetailError::NothingCovered`] for a
    /// correspondence without points.
    pub fn measure<T: Scalar>(
        map: &Correspondence,
        source: &BaseSurface<T>,
        target: &BaseSurface<T>,
    ) -> Result<Self, DetailError> {
        let base = target.base();
        let mesh = base.mesh();
        map.check([source.base().mesh().num_vertices(), mesh.num_vertices()])?;
        let places = map.places(source.base().positions());
        let scale = target.unit() / source.unit();
        let (mut area, mut covered) = (0.0, 0.0);
        let mut stretches: Vec<(f64, f64)> = Vec::new();
        for f in mesh.faces() {
            let corners = mesh.triangle(f).map(|v| base.position(v));
            let size = 0.5
                * (corners[1] - corners[0])
                    .cross(&(corners[2] - corners[0]))
                    .norm();
            area += size;
            if let Some(image) = image(&places, mesh.triangle(f)) {
                covered += size;
                if size > 0.0 {
                    stretches.push((of_face(&corners, &image, scale), size));
                }
            }
        }
        stretches.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(Self {
            coverage: if area > 0.0 { covered / area } else { 0.0 },
            median: quantile(&stretches, 0.5),
            most: quantile(&stretches, 0.95),
        })
    }

    /// Checks the 95 % quantile against a limit.
    ///
    /// # Errors
    /// [`DetailError::Stretched`] if it is larger.
    pub fn check(&self, limit: f64) -> Result<(), DetailError> {
        match self.most <= limit {
            true => Ok(()),
            false => Err(DetailError::Stretched {
                stretch: self.most,
                limit,
            }),
        }
    }
}

/// The corresponding points of the corners, if all have one.
fn image(
    places: &VertexMap<Option<Point3<f64>>>,
    corners: [VertexId; 3],
) -> Option<[Point3<f64>; 3]> {
    let [a, b, c] = corners.map(|v| places[v]);
    Some([a?, b?, c?])
}

/// The larger of σ₁ and 1/σ₂ of the linear map from a triangle of positive area to another.
fn of_face(from: &[Point3<f64>; 3], to: &[Point3<f64>; 3], scale: f64) -> f64 {
    let [e, f] = flat(from);
    let [p, q] = flat(to);
    let inverse = Matrix2::from_columns(&[e, f]).try_inverse();
    let Some(inverse) = inverse else {
        return UNBOUNDED;
    };
    let [long, short] = singular_values(&(Matrix2::from_columns(&[p, q]) * inverse * scale));
    let stretch = long.max(1.0 / short);
    if stretch.is_finite() {
        stretch.min(UNBOUNDED)
    } else {
        UNBOUNDED
    }
}

/// Two edges of a triangle in a basis of its plane.
fn flat([a, b, c]: &[Point3<f64>; 3]) -> [Vector2<f64>; 2] {
    let (e, f) = (b - a, c - a);
    let along = e.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
    let x = f.dot(&along);
    let y = (f - along * x).norm();
    [Vector2::new(e.norm(), 0.0), Vector2::new(x, y)]
}

/// The singular values of a matrix, the larger one first.
fn singular_values(m: &Matrix2<f64>) -> [f64; 2] {
    let sum = (m[(0, 0)] + m[(1, 1)]).hypot(m[(1, 0)] - m[(0, 1)]);
    let difference = (m[(0, 0)] - m[(1, 1)]).hypot(m[(1, 0)] + m[(0, 1)]);
    [0.5 * (sum + difference), 0.5 * (sum - difference).abs()]
}

/// The value below which lies this share of the weight; the pairs are sorted by value.
fn quantile(pairs: &[(f64, f64)], share: f64) -> f64 {
    let total: f64 = pairs.iter().map(|(_, weight)| weight).sum();
    let mut below = 0.0;
    for (value, weight) in pairs {
        below += weight;
        if below >= share * total {
            return *value;
        }
    }
    pairs.last().map_or(1.0, |(value, _)| *value)
}

/// The stretch of a face that has a point or a line as its image.
const UNBOUNDED: f64 = 1e6;
