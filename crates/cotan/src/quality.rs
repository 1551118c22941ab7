//! Measures of the effects of a deformation.

use cotan_geometry::{
    Scalar, Surface, area_distortion, dihedral_changes, edge_distortion_rms, folded_faces, scalar,
    singular_values,
};

use crate::arap::arap_energy;
use crate::comparison::{ShapeComparison, ShapeErrors};
use crate::error::Error;

impl ShapeErrors {
    /// Compares two embeddings of a mesh by cotangent weights.
    ///
    /// # Errors
    /// [`Error`] if the two are not embeddings of the same mesh.
    ///
    /// **Source**: paper, section 3.5.
    pub fn measure<T: Scalar>(
        original: &Surface<'_, T>,
        deformed: &Surface<'_, T>,
    ) -> Result<Self, Error> {
        check_same_mesh(original, deformed)?;
        ShapeComparison::new(original)?.errors(deformed.positions())
    }
}

/// Measures of a deformation, comparing the deformed mesh with the original.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct Quality {
    /// E_p and E_g of the paper.
    pub errors: ShapeErrors,
    /// Root mean square over the edges of |e|/|e⁰| − 1.
    pub edge_distortion_rms: f64,
    /// Root mean square over the faces of area/area⁰ − 1.
    pub area_distortion_rms: f64,
    /// Enclosed volume relative to the original; `None` for an open mesh.
    pub volume_ratio: Option<f64>,
    /// Faces that point against their neighbours but did not in the original (see
    /// [`cotan_geometry::folded_faces`]).
    pub flipped_faces: usize,
    /// Edges whose two faces enclose less than 60° but did not in the original: sharp folds.
    pub folded_edges: usize,
    /// Faces without area in the deformed mesh.
    pub degenerate_faces: usize,
    /// Faces of the deformed mesh that cross another face. Pairs that share a vertex are not
    /// examined (see [`Surface::self_intersections`]).
    pub self_intersecting_faces: usize,
    /// The largest change of a dihedral angle, in degrees, up to 360. It is 0 if nothing can be
    /// measured (see [`cotan_geometry::dihedral_changes`]).
    pub max_dihedral_change: f64,
    /// σ1 over the faces: the factor by which the map of a face stretches the direction that is
    /// stretched most.
    pub stretch: Extent,
    /// 1/σ2 over the faces: the factor by which the map compresses the direction that is
    /// compressed most. Infinite if a face has collapsed.
    pub compression: Extent,
    /// As-rigid-as-possible energy Σ_i Σ_{T at i} Σ_{e of T} 1/12 cot_e |e − R_i e⁰|² over the
    /// original area, with each rotation fitted to the triangles around its vertex ("spokes and
    /// rims"). Never negative, because the sum over a triangle is its area times a square. It
    /// equals half of the mean squared distance of the map from a rotation and is dimensionless;
    /// 0 for a mesh without area.
    pub arap_energy: f64,
}

/// The largest values of a quantity of the faces; 1 without deformation. Faces with almost no
/// original area (a relative height of at most 1e-9) are excluded; the values are 1 if that
/// excludes all faces.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Extent {
    /// The smallest value that at least 99 % of the original area does not exceed.
    pub p99: f64,
    /// The largest value.
    pub max: f64,
}

/// The distance between two shapes of a mesh, vertex by vertex.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ShapeDistance {
    /// The root mean square of the distances between corresponding vertices, relative to the
    /// longest side of the original's bounding box.
    pub rms: f64,
    /// The largest of these distances, in the same unit.
    pub max: f64,
}

impl ShapeDistance {
    /// Measures the distance from `shape` to `given`. `original` defines the unit and may be
    /// either of them. If all its vertices coincide, the result is in the unit of the positions.
    ///
    /// # Errors
    /// [`Error`] if the three are not embeddings of the same mesh.
    pub fn measure<T: Scalar>(
        original: &Surface<'_, T>,
        shape: &Surface<'_, T>,
        given: &Surface<'_, T>,
    ) -> Result<Self, Error> {
        check_same_mesh(original, shape)?;
        check_same_mesh(original, given)?;
        let side = original.bounding_box().longest_side().as_f64();
        let size = if side > 0.0 { side } else { 1.0 };
        let pairs = shape.positions().values().zip(given.positions().values());
        let squares = || {
            let steps = pairs
                .clone()
                .map(|(a, b)| (b - a).map(|x| x.as_f64() / size));
            steps.map(|step| step.norm_squared())
        };
        let mean = squares().sum::<f64>() / shape.positions().len().max(1) as f64;
        Ok(Self {
            rms: mean.sqrt(),
            max: squares().fold(0.0, f64::max).sqrt(),
        })
    }
}

impl Quality {
    /// Computes all measures.
    ///
    /// # Errors
    /// [`Error`] if the two are not embeddings of the same mesh.
    pub fn measure<T: Scalar>(
        original: &Surface<'_, T>,
        deformed: &Surface<'_, T>,
    ) -> Result<Self, Error> {
        let errors = ShapeErrors::measure(original, deformed)?;
        let deformed = &original.with_positions(deformed.positions());
        let is_closed = original.mesh().is_closed();
        let moved = deformed.positions();
        let [stretch, compression] = stretches(original, deformed)?;
        let volumes = [original, deformed].map(|s| s.volume().as_f64());
        Ok(Self {
            errors,
            edge_distortion_rms: edge_distortion_rms(original, moved)?.as_f64(),
            area_distortion_rms: area_distortion(original, moved)?.rms.as_f64(),
            volume_ratio: (is_closed && volumes[0] != 0.0).then(|| volumes[1] / volumes[0]),
            flipped_faces: folded_faces(original, moved)?.len(),
            folded_edges: folded_edges(original, deformed),
            degenerate_faces: deformed.degenerate_faces(scalar(1e-9)).len(),
            self_intersecting_faces: deformed.self_intersections().len(),
            max_dihedral_change: max_dihedral_change(original, deformed)?,
            stretch,
            compression,
            arap_energy: arap_energy(original, deformed),
        })
    }
}

fn max_dihedral_change<T: Scalar>(
    original: &Surface<'_, T>,
    deformed: &Surface<'_, T>,
) -> Result<f64, Error> {
    let changes = dihedral_changes(original, deformed.positions())?;
    let changes = changes.values().flatten().map(|c| c.as_f64());
    Ok(changes.fold(0.0, f64::max).to_degrees())
}

/// σ1 and 1/σ2 over the faces.
fn stretches<T: Scalar>(
    original: &Surface<'_, T>,
    deformed: &Surface<'_, T>,
) -> Result<[Extent; 2], Error> {
    let areas = original.face_areas();
    let values = singular_values(original, deformed.positions())?;
    let extent = |value: fn([f64; 2]) -> f64| {
        let faces = values.values().zip(areas.values());
        extent(faces.filter_map(|(v, area)| Some((value((*v)?), area.as_f64()))))
    };
    Ok([extent(|[s1, _]| s1), extent(|[_, s2]| 1.0 / s2)])
}

/// The extent of values with weights.
fn extent(values: impl Iterator<Item = (f64, f64)>) -> Extent {
    let mut sorted: Vec<(f64, f64)> = values.collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let total: f64 = sorted.iter().map(|(_, weight)| weight).sum();
    let max = sorted.last().map_or(1.0, |(value, _)| *value);
    let mut below = 0.0;
    let reaches = |(_, weight): &&(f64, f64)| {
        below += weight;
        below >= 0.99 * total
    };
    let p99 = sorted.iter().find(reaches).map_or(max, |(value, _)| *value);
    Extent { p99, max }
}

fn check_same_mesh<T: Scalar>(a: &Surface<'_, T>, b: &Surface<'_, T>) -> Result<(), Error> {
    let (a, b) = (a.mesh(), b.mesh());
    if std::ptr::eq(a, b) {
        return Ok(());
    }
    let counts = |m: &cotan_halfedge::HalfedgeMesh| (m.num_vertices(), m.num_faces());
    if counts(a) != counts(b) {
        let ((va, fa), (vb, fb)) = (counts(a), counts(b));
        return Err(Error::DifferentMeshes(format!(
            "{va} vertices and {fa} faces against {vb} vertices and {fb} faces"
        )));
    }
    match a.faces().find(|&f| a.triangle(f) != b.triangle(f)) {
        Some(face) => Err(Error::DifferentMeshes(format!(
            "face {face} has other corners"
        ))),
        None => Ok(()),
    }
}

/// Edges at which the surface folds back on itself (normals more than 120° apart) but did not in
/// the original.
fn folded_edges<T: Scalar>(original: &Surface<'_, T>, deformed: &Surface<'_, T>) -> usize {
    let mesh = original.mesh();
    let (before, after) = (original.face_normals(), deformed.face_normals());
    let threshold = scalar::<T>(-0.5);
    mesh.edges()
        .filter(|e| {
            let [a, b] = e.halfedges().map(|h| mesh.face(h));
            let (Some(a), Some(b)) = (a, b) else {
                return false;
            };
            after[a].dot(&after[b]) < threshold && before[a].dot(&before[b]) >= threshold
        })
        .count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cotan_geometry::Positions;
    use cotan_geometry::shapes::{bar, icosphere};
    use nalgebra::{Isometry3, Point3, Vector3};

    #[test]
    fn a_rigid_motion_has_the_measures_of_none() {
        let shape = icosphere::<f64>(3);
        let motion = Isometry3::new(Vector3::new(3.0, 1.0, 2.0), Vector3::new(0.3, 1.0, -0.4));
        let moved = shape.positions().map(|p| motion * p);
        let surface = shape.surface();
        let quality = Quality::measure(&surface, &surface.with_positions(&moved)).unwrap();
        assert_eq!(quality.self_intersecting_faces, 0);
        assert!(quality.max_dihedral_change < 1e-9);
        for extent in [quality.stretch, quality.compression] {
            assert!((extent.p99 - 1.0).abs() < 1e-12 && (extent.max - 1.0).abs() < 1e-12);
        }
        assert!((0.0..1e-16).contains(&quality.arap_energy));
    }

    /// A bar stretched to twice its length and half its height: the four long sides undergo both.
    #[test]
    fn a_stretched_bar_has_its_factors() {
        let shape = bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
        let surface = shape.surface();
        let moved = shape
            .positions()
            .map(|p| Point3::new(2.0 * p.x, 0.5 * p.y, p.z));
        let quality = Quality::measure(&surface, &surface.with_positions(&moved)).unwrap();
        for (found, expected) in [
            (quality.stretch.p99, 2.0),
            (quality.stretch.max, 2.0),
            (quality.compression.p99, 2.0),
            (quality.compression.max, 2.0),
        ] {
            assert!((found - expected).abs() < 1e-12, "{found}");
        }
        assert!(quality.max_dihedral_change < 1e-9);
        assert!(quality.arap_energy > 0.1);
    }

    #[test]
    fn a_hundredth_of_the_area_does_not_count_in_the_percentile() {
        let last =
            |weight: f64| (0..100).map(move |k| (f64::from(k), if k < 99 { 1.0 } else { weight }));
        // The last value has exactly a hundredth of the total weight, then more.
        let of = |weight| extent(last(weight));
        assert_eq!((of(1.0).p99, of(1.0).max), (98.0, 99.0));
        assert_eq!((of(2.0).p99, of(2.0).max), (99.0, 99.0));
        assert_eq!(extent(std::iter::empty()), Extent { p99: 1.0, max: 1.0 });
    }

    /// The end of a bar is pushed back into its middle, so that the walls pass through each
    /// other.
    #[test]
    fn a_bar_pushed_through_itself_intersects_and_collapsed_faces_are_infinite() {
        let shape = bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
        let surface = shape.surface();
        let narrow = |p: &Point3<f64>| {
            let share = if p.x > 1.9 { 0.5 } else { 1.0 };
            let x = if p.x > 1.9 { -1.0 + 0.013 * p.y } else { p.x };
            Point3::new(x, share * p.y, share * p.z)
        };
        let pushed: Positions<f64> = shape.positions().map(narrow);
        let quality = Quality::measure(&surface, &surface.with_positions(&pushed)).unwrap();
        assert!(quality.max_dihedral_change > 60.0);
        // The cap is inside the bar, and the walls that lead to it do not cross the outer ones.
        assert_eq!(quality.self_intersecting_faces, 0);
        let through = shape.positions().map(|p| {
            let inside = narrow(p);
            if p.x > 1.9 {
                inside + Vector3::y() * 0.6
            } else {
                inside
            }
        });
        let quality = Quality::measure(&surface, &surface.with_positions(&through)).unwrap();
        assert!(quality.self_intersecting_faces > 8);

        let flat = shape.positions().map(|p| Point3::new(p.x, 0.0, p.z));
        let quality = Quality::measure(&surface, &surface.with_positions(&flat)).unwrap();
        assert_eq!(quality.compression.max, f64::INFINITY);
        assert!((quality.stretch.max - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_distance_is_over_the_longest_side_of_the_original() {
        let shape = bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
        let surface = shape.surface();
        let mut given = shape.positions().map(|p| p + Vector3::x());
        let distance = |given: &Positions<f64>| {
            ShapeDistance::measure(&surface, &surface, &surface.with_positions(given)).unwrap()
        };
        let found = distance(&given);
        assert!((found.rms - 0.25).abs() < 1e-15 && (found.max - 0.25).abs() < 1e-15);
        given.as_mut_slice()[0].x += 1.0;
        let found = distance(&given);
        assert!((found.max - 0.5).abs() < 1e-15 && found.rms < 0.26);
        let other = icosphere::<f64>(1);
        assert!(ShapeDistance::measure(&surface, &surface, &other.surface()).is_err());
    }
}
