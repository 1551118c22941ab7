//! The plane about which a surface is symmetric, and the mirror images of its vertices.
//!
//! A mirror plane passes through the centroid of the area, and its normal is an axis of inertia:
//! these axes are tried first. Where two moments of inertia coincide every direction between them
//! is such an axis, so directions all around are tried as well. The best are refined like two
//! scans that are registered: reflect the points, find the closest points of the surface, find the
//! best plane for these pairs, and repeat.
//!
//! **Source**: registration by closest points of P. Besl, N. McKay, "A method for registration of
//! 3-D shapes", PAMI 1992. The best plane for given pairs (p, q) minimizes Σ |Rp − q|² over
//! reflections R at planes: its normal is the eigenvector of the least eigenvalue of
//! 4 Σ sym(p̄ q̄ᵀ) − W d dᵀ, where p̄ and q̄ are relative to the means, d is the difference of the
//! means and W the sum of the weights; it passes through the middle between the means.

use cotan_geometry::{Scalar, Surface, SurfacePoint, SurfaceTree};
use cotan_halfedge::{VertexId, VertexMap};
use nalgebra::{Matrix3, Point3, SymmetricEigen, Unit, Vector3};

/// A plane about which a surface is symmetric.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct MirrorPlane {
    /// A point of the plane.
    pub point: Point3<f64>,
    /// The unit normal. Its greatest coordinate is positive.
    pub normal: Unit<Vector3<f64>>,
    /// The share of the area whose mirror image is on the surface up to the tolerance.
    pub share: f64,
}

impl MirrorPlane {
    /// The plane through `point` with the normal `normal`, for surfaces that were symmetric before
    /// they were posed. Nothing is measured: the share is 1.
    #[must_use]
    pub fn new(point: Point3<f64>, normal: Unit<Vector3<f64>>) -> Self {
        let is_turned = normal[normal.map(f64::abs).imax()] < 0.0;
        Self {
            point,
            normal: if is_turned { -normal } else { normal },
            share: 1.0,
        }
    }

    /// The mirror image of a point.
    #[must_use]
    pub fn reflect(&self, p: &Point3<f64>) -> Point3<f64> {
        p - self.normal.as_ref() * (2.0 * self.normal.dot(&(p - self.point)))
    }

    /// The mirror image of each vertex on the surface, or `None` if it has none within `reach`.
    ///
    /// Values at the vertices are mirrored by interpolation at these points. The vertex next to an
    /// image is the corner with the greatest weight ([`nearest_corner`]).
    ///
    /// **Shapes**: one entry per vertex. **Units**: `reach` is a length.
    #[must_use]
    pub fn images<T: Scalar>(
        &self,
        surface: &Surface<'_, T>,
        reach: f64,
    ) -> VertexMap<Option<SurfacePoint>> {
        let tree = SurfaceTree::new(*surface);
        let positions = surface.positions();
        VertexMap::from_vec(cotan_parallel::filled(positions.len(), |i| {
            let image = self.reflect(&positions[VertexId::new(i)].map(T::as_f64));
            tree.closest_within(&image, reach).map(|closest| closest.on)
        }))
    }
}

/// The corner of the face that has the greatest share of a point of a surface.
#[must_use]
pub fn nearest_corner<T: Scalar>(surface: &Surface<'_, T>, point: &SurfacePoint) -> VertexId {
    let corners = surface.mesh().triangle(point.face);
    let shares = point.barycentric;
    let greatest = (1..3).fold(0, |g, k| if shares[k] > shares[g] { k } else { g });
    corners[greatest]
}

/// The plane about which most of a surface is symmetric, or `None`: at least 70 % of the area must
/// have its mirror image on the surface, up to `tolerance`, a share of the diagonal of the bounding
/// box (.005 suits modelled and scanned characters). A tail that sways does not hide the plane of
/// its animal.
///
/// Of several planes the one with the greatest share, and of those that are equal to a thousandth
/// the one whose normal is nearest to an axis, x before y before z. The plane of a flat surface
/// itself does not count.
///
/// ```
/// use cotan_surface::mirror_plane;
/// let bar = cotan_geometry::bar::<f64>([4.0, 1.0, 2.0], [8, 2, 4]);
/// let plane = mirror_plane(&bar.surface(), 0.005).ok_or("a bar is symmetric")?;
/// assert!(plane.normal.x > 1.0 - 1e-9 && plane.share == 1.0);
/// # Ok::<(), &str>(())
/// ```
#[must_use]
pub fn mirror_plane<T: Scalar>(surface: &Surface<'_, T>, tolerance: f64) -> Option<MirrorPlane> {
    let body = Body::new(surface)?;
    let coarse = body.sample(COARSE);
    let mut tried: Vec<(f64, MirrorPlane)> = body
        .directions()
        .into_iter()
        .map(|normal| MirrorPlane::new(body.centroid, normal))
        .map(|plane| (body.misfit(&plane, COARSE_REACH, &coarse), plane))
        .collect();
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (medium, fine) = (body.sample(MEDIUM), body.sample(FINE));
    let mut best: Option<(f64, MirrorPlane)> = None;
    for (_, plane) in tried.into_iter().take(REFINED) {
        let mut plane = body.refined(plane, COARSE_REACH.max(tolerance), &medium);
        plane = body.refined(plane, tolerance, &medium);
        plane.share = body.share(&plane, tolerance, &fine);
        let rank = plane.share - 1e-3 * preference(&plane.normal);
        let is_better = best.is_none_or(|(greatest, _)| rank > greatest);
        if plane.share >= MIN_SHARE && is_better && !body.is_flat_in(&plane, &fine) {
            best = Some((rank, plane));
        }
    }
    best.map(|(_, plane)| plane)
}

/// Zero for x, and growing for y, z and directions between the axes.
fn preference(normal: &Vector3<f64>) -> f64 {
    let off = 1.0 - normal.amax();
    let axis = normal.map(f64::abs).imax();
    (4.0 * off + 0.1 * axis as f64).min(1.0)
}

/// A surface prepared for tests of planes.
struct Body {
    tree: SurfaceTree,
    points: Vec<Point3<f64>>,
    areas: Vec<f64>,
    centroid: Point3<f64>,
    inertia: Matrix3<f64>,
    size: f64,
}

impl Body {
    /// `None` for a surface without area.
    fn new<T: Scalar>(surface: &Surface<'_, T>) -> Option<Self> {
        let points: Vec<_> = (surface.positions().values())
            .map(|p| p.map(T::as_f64))
            .collect();
        let areas: Vec<_> = (surface.dual_areas().values())
            .map(|a| a.as_f64())
            .collect();
        let bounds = surface.bounding_box();
        let size = (bounds.max - bounds.min).map(T::as_f64).norm();
        let centroid = surface.centroid().map(T::as_f64);
        let total: f64 = areas.iter().sum();
        if !(total > 0.0 && size > 0.0 && total.is_finite() && size.is_finite()) {
            return None;
        }
        // The exact second moments of the triangles, so that the tessellation does not matter.
        let mesh = surface.mesh();
        let mut inertia = Matrix3::zeros();
        for f in mesh.faces() {
            let corners = mesh.triangle(f).map(|v| points[v.index()] - centroid);
            let area = (corners[1] - corners[0])
                .cross(&(corners[2] - corners[0]))
                .norm()
                / 2.0;
            let sum = corners[0] + corners[1] + corners[2];
            let squares: Matrix3<f64> = corners.iter().map(|c| c * c.transpose()).sum();
            inertia += (squares + sum * sum.transpose()) * (area / 12.0);
        }
        Some(Self {
            tree: SurfaceTree::new(*surface),
            points,
            areas,
            centroid,
            inertia,
            size,
        })
    }

    /// The normals to try.
    fn directions(&self) -> Vec<Unit<Vector3<f64>>> {
        let eigen = SymmetricEigen::new(self.inertia);
        let inertia = (0..3).map(|k| eigen.eigenvectors.column(k).into_owned());
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        // A spiral around half of a sphere.
        let around = (0..SPIRAL).map(|i| {
            let z = (i as f64 + 0.5) / SPIRAL as f64;
            let (sin, cos) = (i as f64 * GOLDEN_ANGLE).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vector3::new(r * cos, r * sin, z)
        });
        let all = inertia.chain(axes).chain(around);
        all.filter_map(|n| Unit::try_new(n, 0.0)).collect()
    }

    /// About `count` vertices, evenly spread over the list.
    fn sample(&self, count: usize) -> Vec<usize> {
        let step = self.points.len().div_ceil(count).max(1);
        (0..self.points.len()).step_by(step).collect()
    }

    /// The distances of the mirror images of some vertices from the surface, in units of the size,
    /// with their areas.
    fn distances(&self, plane: &MirrorPlane, vertices: &[usize]) -> Vec<(f64, f64)> {
        cotan_parallel::filled(vertices.len(), |i| {
            let image = plane.reflect(&self.points[vertices[i]]);
            let distance = self.tree.closest(&image).distance / self.size;
            (distance, self.areas[vertices[i]])
        })
    }

    /// The share of the area within `tolerance`.
    fn share(&self, plane: &MirrorPlane, tolerance: f64, vertices: &[usize]) -> f64 {
        let (mut within, mut total) = (0.0, 0.0);
        for (distance, area) in self.distances(plane, vertices) {
            total += area;
            if distance <= tolerance {
                within += area;
            }
        }
        // A sample may have no area.
        if total > 0.0 { within / total } else { 0.0 }
    }

    /// Σ area · d² / (d² + reach²): distances far above `reach` all count the same.
    fn misfit(&self, plane: &MirrorPlane, reach: f64, vertices: &[usize]) -> f64 {
        let distances = self.distances(plane, vertices).into_iter();
        let terms = distances.map(|(d, area)| area * d * d / (d * d + reach * reach));
        terms.sum()
    }

    /// The plane at which the iteration of closest points ends.
    fn refined(&self, plane: MirrorPlane, reach: f64, vertices: &[usize]) -> MirrorPlane {
        let mut best = (self.misfit(&plane, reach, vertices), plane);
        for _ in 0..ROUNDS {
            let Some(next) = self.fitted(&best.1, reach, vertices) else {
                break;
            };
            let misfit = self.misfit(&next, reach, vertices);
            // Also ends where a distance is not a number.
            if !(misfit < best.0 * (1.0 - MIN_GAIN)) {
                break;
            }
            best = (misfit, next);
        }
        best.1
    }

    /// The best plane for the pairs of vertices and the closest points of their images.
    fn fitted(&self, plane: &MirrorPlane, reach: f64, vertices: &[usize]) -> Option<MirrorPlane> {
        let pairs = cotan_parallel::filled(vertices.len(), |i| {
            let p = self.points[vertices[i]];
            let closest = self.tree.closest(&plane.reflect(&p));
            // The weights under which the sum of squares has the gradient of the misfit.
            let far = closest.distance / (reach * self.size);
            let weight = self.areas[vertices[i]] / (1.0 + far * far).powi(2);
            (p, closest.position, weight)
        });
        let total: f64 = pairs.iter().map(|(.., w)| w).sum();
        let p_sum: Vector3<f64> = pairs.iter().map(|(p, _, w)| p.coords * *w).sum();
        let q_sum: Vector3<f64> = pairs.iter().map(|(_, q, w)| q.coords * *w).sum();
        let (p_mean, q_mean) = (p_sum / total, q_sum / total);
        let d = p_mean - q_mean;
        let mut matrix = d * d.transpose() * -total;
        for (p, q, w) in &pairs {
            let (p, q) = (p.coords - p_mean, q.coords - q_mean);
            matrix += (p * q.transpose() + q * p.transpose()) * (2.0 * w);
        }
        if !matrix.iter().all(|x| x.is_finite()) {
            return None;
        }
        let eigen = SymmetricEigen::new(matrix);
        let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin());
        let normal = Unit::try_new(normal.into_owned(), 0.0)?;
        Some(MirrorPlane::new(((p_mean + q_mean) / 2.0).into(), normal))
    }

    /// Returns true if most of the area is in the plane.
    fn is_flat_in(&self, plane: &MirrorPlane, vertices: &[usize]) -> bool {
        let area = |pick: &dyn Fn(usize) -> bool| -> f64 {
            let picked = vertices.iter().filter(|v| pick(**v));
            picked.map(|&v| self.areas[v]).sum()
        };
        let offset = |v: usize| plane.normal.dot(&(self.points[v] - plane.point)).abs();
        area(&|v| offset(v) < FLAT * self.size) > 0.5 * area(&|_| true)
    }
}

/// Directions tried beside the axes of inertia and of the coordinates.
const SPIRAL: usize = 200;

/// The angle between two directions of the spiral.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// Vertices for the first test of a plane, for its refinement, and for its share.
const COARSE: usize = 200;
const MEDIUM: usize = 500;
const FINE: usize = 20_000;

/// The distance within which pairs count at first, a share of the size.
const COARSE_REACH: f64 = 0.05;

/// Planes that are refined.
const REFINED: usize = 6;

/// Rounds of closest points.
const ROUNDS: usize = 40;

/// The share of the misfit that a round must remove.
const MIN_GAIN: f64 = 1e-3;

/// The share of the area that must have a mirror image.
const MIN_SHARE: f64 = 0.7;

/// The distance from a plane within which a surface is in it, a share of the size.
const FLAT: f64 = 0.01;

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

    use cotan_geometry::shapes::{VertexOrder, creature, irregular};
    use cotan_geometry::testing::rigid_motions;
    use cotan_geometry::{Mesh, bar, bumpy_plane, icosphere};
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_bar_is_mirrored_along_its_first_axis() {
        let plane = mirror_plane(&bar::<f64>([4.0, 1.0, 2.0], [8, 2, 4]).surface(), 0.005).unwrap();
        assert!((plane.normal.x - 1.0).abs() < 1e-9 && plane.point.x.abs() < 1e-9);
    }

    #[test]
    fn a_sphere_has_a_plane_and_a_single_bump_leaves_those_through_it() {
        assert!(mirror_plane(&icosphere::<f64>(3).surface(), 0.005).is_some());
        let (connectivity, mut positions) = icosphere::<f64>(3).into_parts();
        let tip = Vector3::new(1.0, 2.0, -0.5).normalize();
        for p in positions.values_mut() {
            *p += p.coords * (0.5 * (-8.0 * (p.coords - tip).norm_squared()).exp());
        }
        let mesh = Mesh::new(connectivity, positions).unwrap();
        let plane = mirror_plane(&mesh.surface(), 0.01).unwrap();
        assert!(plane.normal.dot(&tip).abs() < 0.02, "{plane:?}");
    }

    #[test]
    fn a_shape_of_chance_has_none() {
        let (connectivity, mut positions) =
            irregular::<f64>(400, VertexOrder::Random, 7).into_parts();
        for p in positions.values_mut() {
            let wave = (2.0 * p.x + 0.7).sin() * (3.0 * p.y - 0.4).cos() + (2.5 * p.z + 1.3).sin();
            p.coords *= 1.0 + 0.2 * wave;
            p.x *= 1.5;
            p.y += 0.3 * p.x * p.x;
        }
        let mesh = Mesh::new(connectivity, positions).unwrap();
        assert_eq!(mirror_plane(&mesh.surface(), 0.003), None);
    }

    #[test]
    fn the_plane_of_a_flat_surface_does_not_count() {
        let flat = bumpy_plane::<f64>([3.0, 1.5], [9, 5], 0.0);
        let plane = mirror_plane(&flat.surface(), 0.005).unwrap();
        assert!(plane.normal.z.abs() < 1e-6, "{plane:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3))]

        #[test]
        fn a_creature_is_mirrored_left_to_right_wherever_it_stands(motion in rigid_motions()) {
            let mesh = creature::<f64>(40);
            let positions = mesh.positions().map(|p| motion * p);
            let moved = Mesh::new(mesh.connectivity().clone(), positions).unwrap();
            let plane = mirror_plane(&moved.surface(), 0.005).unwrap();
            let side = motion * Vector3::z();
            prop_assert!(plane.normal.dot(&side).abs() > 0.9999, "{plane:?}");
            // Most vertices have an image, and the image of the image is the vertex.
            let reach = 0.2 * moved.surface().mean_edge_length();
            let images = plane.images(&moved.surface(), reach);
            let found = images.iter().filter_map(|(v, image)| Some((v, image.as_ref()?)));
            let found: Vec<_> = found.collect();
            prop_assert!(found.len() > images.len() / 2);
            for (v, image) in found {
                let p = plane.reflect(&image.position(&moved.surface()));
                prop_assert!((p - moved.positions()[v]).norm() <= 1.001 * reach);
            }
        }
    }
}
