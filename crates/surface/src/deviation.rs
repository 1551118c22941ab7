//! The deviation of one surface from another of any connectivity.
//!
//! ```text
//! Hausdorff   max_{p ∈ A} d(p, B)            mean    ∫_A d(p, B) dp / area of A
//! normals     angle between the normal of A at p and that of B at the point closest to p
//! ```
//!
//! The maximum is bracketed: a triangle of A is split into four as long as it may contain a point
//! that is farther away than the farthest known one by more than the tolerance. The distance from
//! one triangle of B is a convex function, so on a triangle of A it is at most that of a corner.
//!
//! **Source**: Guthe, Borodin, Klein 2005, Fast and accurate Hausdorff distance calculation
//! between meshes; the bound by single triangles as in Tang, Lee, Kim 2009, Interactive Hausdorff
//! distance computation for general polygonal models.

use cotan_geometry::{
    ClosestPoint, Scalar, Surface, SurfaceError, SurfaceTree, angle_between, closest_on_triangle,
    triangle_area_vector,
};
use cotan_halfedge::{FaceId, VertexMap};
use cotan_parallel::Chunks;
use nalgebra::{Point3, Vector3};

/// The deviation of two surfaces from each other.
#[derive(Clone, PartialEq, Debug)]
pub struct Deviation {
    /// From points of the first surface to the second.
    pub forth: OneSidedDeviation,
    /// From points of the second surface to the first.
    pub back: OneSidedDeviation,
}

/// The distances of the points of one surface from another.
#[derive(Clone, PartialEq, Debug)]
pub struct OneSidedDeviation {
    /// The greatest distance found, which is that of a point of the surface.
    pub hausdorff: f64,
    /// No point of the surface is farther away.
    pub hausdorff_bound: f64,
    /// The mean distance, by area.
    pub mean: f64,
    /// The root mean square of the distance, by area.
    pub rms: f64,
    /// The mean angle between the normals, by area, in radians.
    pub mean_normal_angle: f64,
    /// The greatest angle between the normals at a sample, in radians.
    pub greatest_normal_angle: f64,
    /// The distance of each vertex.
    pub of_vertices: VertexMap<f64>,
}

/// Settings of [`deviation`].
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct DeviationOptions {
    /// The width of the bracket of the Hausdorff distance, as a fraction of the diagonal of both
    /// surfaces.
    pub tolerance: f64,
    /// The number of samples of the means on each surface; there is at least one per face.
    pub samples: usize,
}

impl Default for DeviationOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-4,
            samples: 100_000,
        }
    }
}

impl DeviationOptions {
    /// These settings with another [`tolerance`](Self#structfield.tolerance).
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        self.tolerance = tolerance;
        self
    }

    /// These settings with another number of [`samples`](Self#structfield.samples).
    #[must_use]
    pub fn samples(mut self, samples: usize) -> Self {
        self.samples = samples;
        self
    }
}

impl Deviation {
    /// The two-sided Hausdorff distance: the greater of both one-sided ones.
    #[must_use]
    pub fn hausdorff(&self) -> f64 {
        self.forth.hausdorff.max(self.back.hausdorff)
    }

    /// The upper bound of [`Self::hausdorff`].
    #[must_use]
    pub fn hausdorff_bound(&self) -> f64 {
        self.forth.hausdorff_bound.max(self.back.hausdorff_bound)
    }

    /// The mean of both mean distances.
    #[must_use]
    pub fn mean(&self) -> f64 {
        0.5 * (self.forth.mean + self.back.mean)
    }
}

/// Measures two surfaces against each other. They may have different connectivity, boundaries and
/// any number of components.
///
/// **Units**: those of the positions, which must be the same for both.
///
/// ```
/// use cotan_geometry::icosphere;
/// use cotan_surface::{DeviationOptions, deviation};
///
/// let (coarse, fine) = (icosphere::<f64>(3), icosphere::<f64>(4));
/// let deviation = deviation(&coarse, &fine, &DeviationOptions::default())?;
/// assert!(deviation.hausdorff() < 0.01);
/// assert!(deviation.mean() < deviation.hausdorff());
/// # Ok::<(), cotan_geometry::SurfaceError>(())
/// ```
///
/// # Errors
/// [`SurfaceError`] for positions that are not finite.
pub fn deviation<'m, T: Scalar>(
    first: impl Into<Surface<'m, T>>,
    second: impl Into<Surface<'m, T>>,
    options: &DeviationOptions,
) -> Result<Deviation, SurfaceError> {
    let (first, second) = (first.into(), second.into());
    let first = Surface::new(first.mesh(), first.positions())?;
    let second = Surface::new(second.mesh(), second.positions())?;
    let [a, b] = [&first, &second].map(|surface| Side::new(surface));
    Ok(Deviation {
        forth: one_sided(&a, &b, options),
        back: one_sided(&b, &a, options),
    })
}

/// A surface with its tree.
struct Side {
    triangles: Vec<[Point3<f64>; 3]>,
    points: Vec<Point3<f64>>,
    area: f64,
    diagonal: f64,
    tree: SurfaceTree,
}

impl Side {
    fn new<T: Scalar>(surface: &Surface<'_, T>) -> Self {
        let mesh = surface.mesh();
        let position = |v| surface.position(v).map(T::as_f64);
        let triangles: Vec<[Point3<f64>; 3]> = mesh
            .faces()
            .map(|f| mesh.triangle(f).map(position))
            .collect();
        let area = CHUNKS.sum::<f64>(triangles.len(), |f| area_vector(&triangles[f]).norm());
        Self {
            points: mesh.vertices().map(position).collect(),
            area,
            diagonal: surface.bounding_box().diagonal().as_f64(),
            tree: SurfaceTree::new(*surface),
            triangles,
        }
    }

    fn corners(&self, face: FaceId) -> &[Point3<f64>; 3] {
        &self.triangles[face.index()]
    }
}

fn area_vector([a, b, c]: &[Point3<f64>; 3]) -> Vector3<f64> {
    triangle_area_vector(a, b, c)
}

fn one_sided(from: &Side, to: &Side, options: &DeviationOptions) -> OneSidedDeviation {
    let feet = to.tree.closest_of(&from.points);
    let sums = means(from, to, options);
    let of_vertices: VertexMap<f64> = feet.iter().map(|foot| foot.distance).collect();
    let known = of_vertices.values().fold(sums.farthest, |m, d| m.max(*d));
    let tolerance = options.tolerance.max(1e-12) * from.diagonal.max(to.diagonal);
    let (hausdorff, hausdorff_bound) = bracket(from, to, known, tolerance);
    OneSidedDeviation {
        hausdorff,
        hausdorff_bound,
        mean: sums.distance / from.area,
        rms: (sums.squares / from.area).sqrt(),
        mean_normal_angle: sums.angle / from.area,
        greatest_normal_angle: sums.greatest_angle,
        of_vertices,
    }
    .without_area(from)
}

impl OneSidedDeviation {
    /// The means over a surface without area are those of its vertices.
    fn without_area(mut self, from: &Side) -> Self {
        if !(from.area > 0.0) {
            let n = self.of_vertices.len().max(1) as f64;
            self.mean = self.of_vertices.values().sum::<f64>() / n;
            self.rms = (self.of_vertices.values().map(|d| d * d).sum::<f64>() / n).sqrt();
            self.mean_normal_angle = 0.0;
        }
        self
    }
}

/// Integrals over a surface, and maxima over its samples.
#[derive(Clone, Copy, Default)]
struct Sums {
    distance: f64,
    squares: f64,
    angle: f64,
    greatest_angle: f64,
    farthest: f64,
}

impl std::iter::Sum for Sums {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::default(), |a, b| Self {
            distance: a.distance + b.distance,
            squares: a.squares + b.squares,
            angle: a.angle + b.angle,
            greatest_angle: a.greatest_angle.max(b.greatest_angle),
            farthest: a.farthest.max(b.farthest),
        })
    }
}

/// Samples every face at the centres of equal parts.
fn means(from: &Side, to: &Side, options: &DeviationOptions) -> Sums {
    let per_area = options.samples as f64 / from.area;
    CHUNKS.sum(from.triangles.len(), |f| {
        let corners = &from.triangles[f];
        let normal = area_vector(corners);
        let area = normal.norm();
        // Equal faces have equal numbers of samples, also after rounding.
        let wanted = ((area * per_area).sqrt() - 1e-6).ceil();
        let cuts = if wanted.is_finite() {
            wanted.clamp(1.0, 64.0)
        } else {
            1.0
        };
        let share = area / (cuts * cuts);
        let samples = centres(corners, cuts as u32).map(|point| {
            let foot = to.tree.closest(&point);
            let other = area_vector(to.corners(foot.on.face));
            let angle = angle_between(&normal, &other);
            Sums {
                distance: share * foot.distance,
                squares: share * foot.distance * foot.distance,
                angle: share * angle,
                greatest_angle: angle,
                farthest: foot.distance,
            }
        });
        samples.sum::<Sums>()
    })
}

/// The centres of the n² equal parts into which parallels to its sides cut a triangle.
fn centres(corners: &[Point3<f64>; 3], n: u32) -> impl Iterator<Item = Point3<f64>> + use<> {
    let (origin, along, up) = (corners[0], corners[1] - corners[0], corners[2] - corners[0]);
    let at = move |x: f64, y: f64| origin + along * (x / f64::from(n)) + up * (y / f64::from(n));
    (0..n).flat_map(move |j| {
        (0..n - j).flat_map(move |i| {
            let (x, y) = (f64::from(i), f64::from(j));
            let lower = at(x + 1.0 / 3.0, y + 1.0 / 3.0);
            let upper = (i + j + 1 < n).then(|| at(x + 2.0 / 3.0, y + 2.0 / 3.0));
            std::iter::once(lower).chain(upper)
        })
    })
}

/// A part of a face of the first surface, with the points closest to its corners.
#[derive(Clone, Copy)]
struct Part {
    corners: [Point3<f64>; 3],
    feet: [ClosestPoint; 3],
    bound: f64,
}

impl Part {
    fn new(corners: [Point3<f64>; 3], to: &Side) -> Self {
        let feet = corners.map(|p| to.tree.closest(&p));
        let farthest = |face: FaceId| {
            let triangle = to.corners(face);
            let away = |p: &Point3<f64>| (closest_on_triangle(p, triangle).1 - p).norm();
            corners.iter().map(away).fold(0.0, f64::max)
        };
        // The distance from one triangle is convex; that from the surface is no greater. It also
        // grows by no more than the way from a corner.
        let by_triangle = feet.iter().map(|foot| farthest(foot.on.face));
        let by_way = (0..3).map(|k| {
            let next = (corners[(k + 1) % 3] - corners[k]).norm();
            let last = (corners[(k + 2) % 3] - corners[k]).norm();
            feet[k].distance + next.max(last)
        });
        let bound = by_triangle.chain(by_way).fold(f64::INFINITY, f64::min);
        Self {
            corners,
            feet,
            bound,
        }
    }

    fn farthest(&self) -> f64 {
        self.feet
            .iter()
            .fold(0.0_f64, |m, foot| m.max(foot.distance))
    }

    /// The quarter at a corner, or the middle one.
    fn quarter(&self, which: usize) -> [Point3<f64>; 3] {
        let middle = |k: usize| nalgebra::center(&self.corners[k % 3], &self.corners[(k + 1) % 3]);
        match which {
            3 => [middle(0), middle(1), middle(2)],
            k => [self.corners[k], middle(k), middle(k + 2)],
        }
    }
}

/// A lower and an upper bound of the greatest distance.
fn bracket(from: &Side, to: &Side, known: f64, tolerance: f64) -> (f64, f64) {
    let mut lowest = known;
    let mut parts = PARTS.filter_map(from.triangles.len(), |f| {
        let part = Part::new(from.triangles[f], to);
        (part.bound > known + tolerance).then_some(part)
    });
    for _ in 0..MAX_SPLITS {
        parts.retain(|part| part.bound > lowest + tolerance);
        if parts.is_empty() || parts.len() > MAX_PARTS {
            break;
        }
        let quarters = PARTS.filled(4 * parts.len(), |i| {
            Part::new(parts[i / 4].quarter(i % 4), to)
        });
        lowest = quarters.iter().map(Part::farthest).fold(lowest, f64::max);
        parts = quarters;
    }
    parts.retain(|part| part.bound > lowest + tolerance);
    let greatest = parts.iter().map(|part| part.bound);
    // Everything that was dropped is within the tolerance.
    (lowest, greatest.fold(lowest + tolerance, f64::max))
}

/// Maximum number of rounds of splitting: 4^20 parts of a face are smaller than any tolerance.
const MAX_SPLITS: usize = 20;

/// Maximum number of parts in one round. Beyond it the bracket stays wider than requested.
const MAX_PARTS: usize = 2_000_000;

/// Faces per task.
const CHUNKS: Chunks = Chunks::of(256);

/// Parts per task.
const PARTS: Chunks = Chunks::of(64);

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{bar, icosphere};
    use cotan_geometry::testing::{rigid_motions, surfaces};
    use proptest::prelude::*;

    use super::*;

    fn measure(a: &cotan_geometry::Mesh<f64>, b: &cotan_geometry::Mesh<f64>) -> Deviation {
        let options = DeviationOptions::default().samples(2000);
        deviation(a, b, &options).unwrap()
    }

    #[test]
    fn boxes_within_each_other_have_known_distances() {
        // Cubes of side 2 and 3 with the same centre: faces are 0.5 apart, corners √0.75.
        let [small, large] = [(2.0, 4), (3.0, 3)].map(|(side, cuts)| {
            let mut shape = bar::<f64>([side; 3], [cuts; 3]);
            let center = shape.surface().bounding_box().center();
            shape
                .positions_mut()
                .iter_mut()
                .for_each(|p| *p -= center.coords);
            shape
        });
        let found = measure(&small, &large);
        let width = 1e-4 * 27.0_f64.sqrt() * (1.0 + 1e-9);
        let is_within = |d: &OneSidedDeviation, exact: f64| {
            d.hausdorff <= exact + 1e-12
                && d.hausdorff_bound >= exact - 1e-12
                && d.hausdorff_bound - d.hausdorff <= width
        };
        assert!(is_within(&found.forth, 0.5), "{found:?}");
        assert!(is_within(&found.back, 0.75_f64.sqrt()), "{found:?}");
        assert!((found.forth.mean - 0.5).abs() < 1e-12);
        assert!((found.hausdorff() - 0.75_f64.sqrt()).abs() < 1e-12);
        assert!(found.forth.greatest_normal_angle < 1e-7);
        assert!(found.back.mean > 0.5 && found.back.mean < 0.75_f64.sqrt());
        // A half-open box is farther away in the middle of its missing side only.
        assert_eq!(found.forth.of_vertices.len(), small.num_vertices());
    }

    #[test]
    fn the_greatest_distance_may_be_inside_a_face() {
        // One large triangle over a coarse ball: the far point is none of its corners.
        let ball = icosphere::<f64>(3);
        let corners = [[-1.2, -1.2, 0.0], [1.2, -1.2, 0.0], [0.0, 1.3, 0.0]];
        let sheet = cotan_geometry::Mesh::<f64>::from_triangles(&corners, &[0, 1, 2]).unwrap();
        let found = measure(&sheet, &ball).forth;
        // The inscribed ball leaves out a little less than its radius in the centre.
        assert!(
            found.hausdorff > 0.97 && found.hausdorff <= 1.0,
            "{found:?}"
        );
        assert!(found.hausdorff_bound < found.hausdorff + 0.001);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn a_surface_does_not_deviate_from_itself_and_motions_change_nothing(
            shape in surfaces(), other in surfaces(), motion in rigid_motions(),
        ) {
            let size = shape.surface().bounding_box().diagonal();
            let own = measure(&shape, &shape);
            let width = 1.001e-4 * size;
            prop_assert!(own.hausdorff() < 1e-12 * (size + 100.0));
            prop_assert!(own.hausdorff_bound() < width + 1e-9);
            let go = |mesh: &cotan_geometry::Mesh<f64>| {
                mesh.with_positions(mesh.positions().map(|p| motion * p))
            };
            let (before, after) = (measure(&shape, &other), measure(&go(&shape)?, &go(&other)?));
            let size = before.hausdorff() + size + 100.0;
            prop_assert!(before.hausdorff() <= after.hausdorff_bound() + 1e-12 * size);
            prop_assert!(after.hausdorff() <= before.hausdorff_bound() + 1e-12 * size);
            prop_assert!((before.mean() - after.mean()).abs() < 1e-9 * size);
            for (a, b) in before.back.of_vertices.values().zip(after.back.of_vertices.values()) {
                prop_assert!((a - b).abs() < 1e-10 * size);
                prop_assert!(*a <= before.back.hausdorff);
            }
        }
    }
}
