//! Pointwise curvature: Gaussian and mean by formulas of the mesh, principal curvatures and their
//! directions by a fitted quadric.
//!
//! All are **positive where the surface is convex**, as seen from outside: a sphere of radius r has
//! the principal curvatures 1/r.
//!
//! Gaussian and mean curvature are integrals over a vertex, divided by its area:
//!
//! ```text
//! K_i = (2π − Σ angles) / A_i        H_i = −ℓ_i · n_i / 4 A_i        A_i: mixed Voronoi area
//! ```
//!
//! **Source**: Meyer, Desbrun, Schröder, Barr 2003, Discrete differential-geometry operators for
//! triangulated 2-manifolds.
//!
//! Principal curvatures come from the quadric z = ½(a x² + 2 b x y + c y²) + d x + e y through the
//! vertex that best fits its two rings of neighbours, over the plane across the vertex normal. Its
//! error falls with the edge length whatever the triangles, which that of a tensor averaged over
//! faces (Rusinkiewicz 2004) does only on regular meshes; d and e remove the error of the normal.
//!
//! **Source**: Cazals and Pouget 2005, Estimating differential quantities using polynomial fitting
//! of osculating jets, with degree 2.

use std::collections::BTreeSet;

use cotan_geometry::{Scalar, Surface, maps, unit_or_zero};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::{Cotangent, Lumping, Operator, SchemeError, lumped_masses};
use cotan_parallel::Chunks;
use nalgebra::{Matrix2, Matrix5, Point3, Vector3, Vector5};

/// The Gaussian curvature at each vertex: angle defect per area.
///
/// **Shapes**: one entry per vertex. **Units**: one over area. 0 at the boundary, where the angle
/// defect is the turn of the boundary, and where there is no area.
#[must_use]
pub fn gaussian_curvatures<'m, T: Scalar>(surface: impl Into<Surface<'m, T>>) -> VertexMap<f64> {
    let surface = surface.into();
    let mesh = surface.mesh();
    let defects = surface.angle_defects();
    let areas = lumped_masses(&surface, Lumping::MixedVoronoi);
    maps::filled(mesh.num_vertices(), |v| {
        let area = areas[v].as_f64();
        if mesh.is_boundary_vertex(v) || !(area > 0.0) {
            return 0.0;
        }
        defects[v].as_f64() / area
    })
}

/// The mean curvature at each vertex, (κ₁ + κ₂) / 2: the part of the Laplacian of the positions
/// along the normal, per area.
///
/// **Shapes**: one entry per vertex. **Units**: one over length. 0 at the boundary, where the
/// Laplacian has a part across it, at vertices with copies, and where there is no area.
///
/// # Errors
/// [`SchemeError`] if a weight is not finite.
pub fn mean_curvatures<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
) -> Result<VertexMap<f64>, SchemeError> {
    let surface = surface.into();
    let mesh = surface.mesh();
    let operator = Operator::assemble(&Cotangent::default(), &surface)?;
    let areas = lumped_masses(&surface, Lumping::MixedVoronoi);
    let normals = surface.vertex_normals();
    Ok(maps::filled(mesh.num_vertices(), |v| {
        let area = areas[v].as_f64();
        if !mesh.is_inner_vertex(v) || !(area > 0.0) {
            return 0.0;
        }
        let ell = operator.apply_at(surface.positions(), v.index());
        -ell.dot(&normals[v].map(T::as_f64)) / (4.0 * area)
    }))
}

/// Principal curvatures and their directions at a vertex.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PrincipalCurvature {
    /// κ₁ ≥ κ₂. **Units**: one over length.
    pub curvatures: [f64; 2],
    /// Their directions: unit vectors, perpendicular to each other and to the normal. Their signs
    /// mean nothing, and where both curvatures are equal, any directions will do.
    pub directions: [Vector3<f64>; 2],
    /// The unit normal of the quadric at the vertex.
    pub normal: Vector3<f64>,
}

impl PrincipalCurvature {
    /// (κ₁ + κ₂) / 2.
    #[must_use]
    pub fn mean(&self) -> f64 {
        0.5 * (self.curvatures[0] + self.curvatures[1])
    }

    /// κ₁ κ₂.
    #[must_use]
    pub fn gaussian(&self) -> f64 {
        self.curvatures[0] * self.curvatures[1]
    }

    const NONE: Self = Self {
        curvatures: [0.0; 2],
        directions: [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.0)],
        normal: Vector3::new(0.0, 0.0, 1.0),
    };
}

/// The principal curvatures and directions at each vertex, also at the boundary, where the
/// neighbours are on one side only and the error is larger.
///
/// **Shapes**: one entry per vertex. A vertex with fewer than five neighbours in two rings has the
/// flattest quadric near them. Curvatures are 0 where the normal is undefined.
#[must_use]
pub fn principal_curvatures<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
) -> VertexMap<PrincipalCurvature> {
    let surface = surface.into();
    let normals = surface.vertex_normals();
    let fits = CHUNKS.filled(surface.mesh().num_vertices(), |i| {
        let v = VertexId::new(i);
        fit(&surface, v, normals[v].map(T::as_f64)).unwrap_or(PrincipalCurvature::NONE)
    });
    VertexMap::from_vec(fits)
}

fn fit<T: Scalar>(
    surface: &Surface<'_, T>,
    v: VertexId,
    normal: Vector3<f64>,
) -> Option<PrincipalCurvature> {
    if !(normal.norm_squared() > 0.5) {
        return None;
    }
    let position = |v: VertexId| surface.position(v).map(T::as_f64);
    let origin: Point3<f64> = position(v);
    let (x, y) = tangents(&normal);
    let offsets: Vec<Vector3<f64>> = two_rings(surface.mesh(), v)
        .into_iter()
        .map(|w| position(w) - origin)
        .map(|offset| Vector3::new(offset.dot(&x), offset.dot(&y), offset.dot(&normal)))
        .collect();
    let size = offsets.iter().fold(0.0_f64, |m, o| m.max(o.norm()));
    if !(size > 0.0) {
        return None;
    }
    let [a, b, c, d, e] = quadric(&offsets, size)?;
    // Fundamental forms of z(x, y) at the origin; convex is positive, so the second is negated.
    let first = Matrix2::new(1.0 + d * d, d * e, d * e, 1.0 + e * e);
    let height = (1.0 + d * d + e * e).sqrt();
    let second = Matrix2::new(a, b, b, c) / -height;
    // In an orthonormal frame of the tangent plane: columns of `frame` by Gram–Schmidt.
    let lower = first.cholesky()?.l();
    let inverse = lower.try_inverse()?;
    let shape = inverse * second * inverse.transpose();
    let eigen = shape.symmetric_eigen();
    let order = if eigen.eigenvalues[0] >= eigen.eigenvalues[1] {
        [0, 1]
    } else {
        [1, 0]
    };
    let to_space = |k: usize| {
        let planar = inverse.transpose() * eigen.eigenvectors.column(k);
        let rise = planar.x * d + planar.y * e;
        unit_or_zero(&(x * planar.x + y * planar.y + normal * rise))
    };
    Some(PrincipalCurvature {
        curvatures: order.map(|k| eigen.eigenvalues[k]),
        directions: order.map(to_space),
        normal: (normal - x * d - y * e) / height,
    })
}

/// The coefficients a … e of the quadric in least squares, with coordinates scaled to at most 1.
fn quadric(offsets: &[Vector3<f64>], size: f64) -> Option<[f64; 5]> {
    let (mut normal, mut right) = (Matrix5::zeros(), Vector5::zeros());
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for offset in offsets {
        let p = offset / size;
        // With √2 b for the second unknown the norm of all five does not depend on the frame.
        let row = Vector5::new(0.5 * p.x * p.x, half * p.x * p.y, 0.5 * p.y * p.y, p.x, p.y);
        normal += row * row.transpose();
        right += row * p.z;
    }
    // Decides where neighbours are too few, or all on a conic, and is lost elsewhere.
    let ridge = RIDGE * normal.trace();
    let k = (normal + Matrix5::identity() * ridge)
        .cholesky()?
        .solve(&right);
    Some([k[0] / size, k[1] * half / size, k[2] / size, k[3], k[4]])
}

/// The preference for small quadrics, relative to the fit.
const RIDGE: f64 = 1e-8;

/// The neighbours of a vertex and their neighbours, ascending.
fn two_rings(mesh: &HalfedgeMesh, v: VertexId) -> BTreeSet<VertexId> {
    let mut around: BTreeSet<VertexId> = mesh.one_ring(v).take(MAX_NEIGHBOURS).collect();
    let first: Vec<VertexId> = around.iter().copied().collect();
    for w in first {
        if around.len() < MAX_NEIGHBOURS {
            around.extend(mesh.one_ring(w).take(MAX_NEIGHBOURS));
        }
    }
    around.remove(&v);
    around
}

/// Two unit vectors that make a right-handed frame with a unit normal.
///
/// **Source**: Duff et al. 2017, Building an orthonormal basis, revisited.
fn tangents(n: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (
        Vector3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        Vector3::new(b, sign + n.y * n.y * a, -n.y),
    )
}

/// Around a hub of a huge valence a part of the rings is enough.
const MAX_NEIGHBOURS: usize = 200;

/// Vertices per task.
const CHUNKS: Chunks = Chunks::of(256);

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{bumpy_plane, cylinder, icosphere, torus};
    use cotan_geometry::testing::{rigid_motions, surfaces};
    use cotan_geometry::{Mesh, bounding_box};
    use proptest::prelude::*;

    use super::*;

    /// Root mean square of the misses of κ₁ and κ₂.
    fn miss(shape: &Mesh<f64>, exact: impl Fn(&Point3<f64>) -> Option<[f64; 2]>) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (v, found) in principal_curvatures(shape).iter() {
            if let Some(exact) = exact(&shape.positions()[v]) {
                sum += (found.curvatures[0] - exact[0]).powi(2);
                sum += (found.curvatures[1] - exact[1]).powi(2);
                count += 2.0;
            }
        }
        (sum / count).sqrt()
    }

    fn falls(errors: [f64; 3], limit: f64) {
        assert!(
            errors[1] < 0.6 * errors[0] && errors[2] < 0.6 * errors[1],
            "{errors:?}"
        );
        assert!(errors[2] < limit, "{errors:?}");
    }

    #[test]
    fn a_sphere_has_the_same_curvature_everywhere() {
        let of = |n| miss(&icosphere::<f64>(n), |_| Some([1.0, 1.0]));
        falls([2, 3, 4].map(of), 0.01);
        let shape = icosphere::<f64>(4);
        for k in gaussian_curvatures(&shape).values() {
            assert!((k - 1.0).abs() < 0.05, "{k}");
        }
        for h in mean_curvatures(&shape).unwrap().values() {
            assert!((h - 1.0).abs() < 0.02, "{h}");
        }
    }

    #[test]
    fn a_torus_has_its_principal_curvatures_and_directions() {
        let (major, minor) = (1.0, 0.4);
        // The axis of the shape, found by its flat extent.
        let shape = torus::<f64>(major, minor, 48, 24);
        let extents = bounding_box(&shape.surface()).extents();
        let axis = Vector3::ith(extents.imin(), 1.0);
        let exact = |p: &Point3<f64>| {
            let height = axis.dot(&p.coords);
            let around = (p.coords - axis * height).norm();
            // cos of the angle around the tube.
            let cos = (around - major) / minor;
            Some([1.0 / minor, cos / (major + minor * cos)])
        };
        let of = |k: usize| miss(&torus(major, minor, 24 * k, 12 * k), exact);
        falls([1, 2, 4].map(of), 0.03);
        for (v, found) in principal_curvatures(&shape).iter() {
            // κ₂ runs around the axis.
            let p = shape.positions()[v].coords;
            let around = unit_or_zero(&axis.cross(&p));
            assert!(found.directions[1].dot(&around).abs() > 0.99);
            assert!(found.directions[0].dot(&found.directions[1]).abs() < 1e-9);
        }
    }

    #[test]
    fn a_cylinder_is_curved_in_one_direction() {
        let exact = |p: &Point3<f64>| {
            // Away from the caps.
            let away = Vector3::new(p.x, p.y, p.z);
            (away.amax() < 0.7).then_some([2.0, 0.0])
        };
        let shape = cylinder::<f64>(0.5, 4.0, 24, 16);
        let extents = bounding_box(&shape.surface()).extents();
        assert!((extents.max() - 4.0).abs() < 1e-9);
        let of = |k: usize| {
            let mut shape = cylinder::<f64>(0.5, 4.0, 12 * k, 16 * k);
            let center = bounding_box(&shape.surface()).center();
            shape
                .positions_mut()
                .iter_mut()
                .for_each(|p| *p -= center.coords);
            miss(&shape, exact)
        };
        falls([1, 2, 4].map(of), 0.03);
    }

    #[test]
    fn a_saddle_is_curved_both_ways() {
        let of = |k: usize| {
            let mut shape = bumpy_plane::<f64>([2.0, 2.0], [8 * k, 8 * k], 0.0);
            let center = bounding_box(&shape.surface()).center();
            for p in shape.positions_mut() {
                let (x, y) = (p.x - center.x, p.y - center.y);
                // Uneven triangles.
                let (x, y) = (x + 0.1 * x * y, y + 0.05 * x * x);
                *p = Point3::new(x, y, 0.5 * (x * x - y * y) + 0.2 * x * y * y);
            }
            let at_center = |p: &Point3<f64>| (p.coords.xy().norm() < 0.05).then_some([1.0, -1.0]);
            miss(&shape, at_center)
        };
        falls([1, 2, 4].map(of), 0.01);
    }

    proptest! {
        #[test]
        fn curvatures_turn_with_the_surface_and_fall_with_its_scale(
            shape in surfaces(), motion in rigid_motions(), scale in 0.1..10.0_f64,
        ) {
            let go = |p: &Point3<f64>| motion * Point3::from(p.coords * scale);
            let moved = shape.with_positions(shape.positions().map(go))?;
            let (before, after) = (principal_curvatures(&shape), principal_curvatures(&moved));
            for (v, a) in before.iter() {
                let b = &after[v];
                let size = 1.0 + a.curvatures[0].abs().max(a.curvatures[1].abs());
                for k in 0..2 {
                    prop_assert!(b.curvatures[k].is_finite());
                    let miss = (b.curvatures[k] * scale - a.curvatures[k]).abs();
                    // Small where few neighbours leave the quadric open, too.
                    prop_assert!(miss < 1e-4 * size, "{} {:?} {:?}", v, a, b);
                }
            }
            let (k, h) = (gaussian_curvatures(&shape), mean_curvatures(&shape)?);
            let (moved_k, moved_h) = (gaussian_curvatures(&moved), mean_curvatures(&moved)?);
            for v in shape.connectivity().vertices() {
                prop_assert!((moved_k[v] * scale * scale - k[v]).abs() < 1e-6 * (1.0 + k[v].abs()));
                prop_assert!((moved_h[v] * scale - h[v]).abs() < 1e-6 * (1.0 + h[v].abs()));
            }
        }
    }
}
