//! Differences between two embeddings of a mesh: lengths, angles, areas, creases and folds.
//!
//! Each function takes the surface at rest and the deformed positions of the same mesh. All
//! measures are zero for rigid motions; angles and folds are zero for uniform scaling as well.

use cotan_halfedge::{EdgeId, EdgeMap, FaceId, FaceMap, HalfedgeMesh};
use nalgebra::Vector3;

use crate::angles::corner_angles;
use crate::areas::{face_area_vectors, face_areas};
use crate::curvature::dihedral_angle;
use crate::lengths::edge_lengths;
use crate::maps;
use crate::scalar::{Scalar, scalar};
use crate::surface::{Positions, Surface, SurfaceError};

/// Statistics over all elements of the ratio q'/q of a positive quantity, deformed over rest.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Distortion<T> {
    /// sqrt(mean((q'/q − 1)²)).
    pub rms: T,
    /// The smallest q'/q.
    pub min_ratio: T,
    /// The largest q'/q.
    pub max_ratio: T,
    /// The number of elements compared.
    pub num_compared: usize,
    /// The number of elements skipped because the quantity is zero at rest.
    pub num_skipped: usize,
}

/// The ratio of the deformed length of each edge to its length at rest, or `None` if that is
/// zero.
///
/// **Shapes**: one entry per edge. **Units**: dimensionless.
///
/// # Errors
/// [`SurfaceError`] if `deformed` does not embed the mesh.
pub fn edge_length_ratios<T: Scalar>(
    rest: &Surface<'_, T>,
    deformed: &Positions<T>,
) -> Result<EdgeMap<Option<T>>, SurfaceError> {
    let after = edge_lengths(&Surface::new(rest.mesh(), deformed)?);
    let before = edge_lengths(rest);
    let ratio = |(&l, &l_new): (&T, &T)| (l > T::zero()).then(|| l_new / l);
    Ok(before.values().zip(after.values()).map(ratio).collect())
}

/// Edge-length distortion: the [`Distortion`] of the edge lengths.
///
/// **Units**: dimensionless. Edges with zero length at rest are skipped and counted.
///
/// # Errors
/// [`SurfaceError`] if `deformed` does not embed the mesh.
///
/// ```
/// use cotan_geometry::{edge_distortion, icosphere};
/// let shape = icosphere::<f64>(2);
/// let larger = shape.positions().map(|p| p * 1.5);
/// let distortion = edge_distortion(&shape.surface(), &larger)?;
/// assert!((distortion.rms - 0.5).abs() < 1e-14);
/// # Ok::<(), cotan_geometry::SurfaceError>(())
/// ```
pub fn edge_distortion<T: Scalar>(
    rest: &Surface<'_, T>,
    deformed: &Positions<T>,
) -> Result<Distortion<T>, SurfaceError> {
    Ok(summarize(
        edge_length_ratios(rest, deformed)?.values().copied(),
    ))
}

/// The `rms` of [`edge_distortion`]: sqrt(mean((l'/l − 1)²)).
///
/// # Errors
/// [`SurfaceError`] if `deformed` does not embed the mesh.
pub fn edge_distortion_rms<T: Scalar>(
    rest: &Surface<'_, T>,
    deformed: &Positions<T>,
) -> Result<T, SurfaceError> {
    Ok(edge_distortion(rest, deformed)?.rms)
}

/// Area distortion: the [`Distortion`] of the face areas.
///
/// **Units**: dimensionless. Faces with zero area at rest are skipped and counted.
///
/// # Errors
/// [`SurfaceError`] if `deformed` does not embed the mesh.
pub fn area_distortion<T: Scalar>(
    rest: &Surface<'_, T>,
    deformed: &Positions<T>,
) -> Result<Distortion<T>, SurfaceError> {
    let after = face_areas(&Surface::new(rest.mesh(), deformed)?);
    let before = face_areas(rest);
    let ratio = |(&a, &a_new): (&T, &T)| (a > T::zero()).then(|| a_new / a);
    Ok(summarize(before.values().zip(after.values()).map(ratio)))
}

/// Angle distortion: the root mean square of the change of all corner angles.
///
/// **Units**: radians. Zero for rigid motions and uniform scaling, and only for maps that
/// preserve the shape of every triangle.
///
/// # Errors
/// [`SurfaceError`] if `deformed` does not embed the mesh.
pub fn angle_distortion_rms<T: Scalar>(
    rest: &Surface<'_, T>,
    deformed: &Positions<T>,
) -> Result<T, SurfaceError> {
    let after = corner_angles(&Surface::new(rest.mesh(), deformed)?);
    let before = corner_angles(rest);
    // Boundary halfedges have no corner: their difference is zero and they are not counted.
    let squares: f64 = before
        .values()
        .zip(after.values())
        .map(|(&a, &b)| (b - a).as_f64().powi(2))
        .sum();
    Ok(T::of_f64(
        (squares / (3 * rest.mesh().num_faces()) as f64).sqrt(),
    ))
}

/// The absolute change of the [dihedral angle](crate::dihedral_angle) at each edge. `None` at the
/// boundary, and where one of the two faces has almost no area in either shape (a relative height
/// of at most 1e-9).
///
/// Angles range from −π to π without a jump when a crease closes: an angle that passes from
/// convex through flat to concave may change by up to 2π.
///
/// **Shapes**: one entry per edge. **Units**: radians, non-negative.
///
/// # Errors
/// [`SurfaceError`] if `deformed` does not embed the mesh.
pub fn dihedral_changes<T: Scalar>(
    rest: &Surface<'_, T>,
    deformed: &Positions<T>,
) -> Result<EdgeMap<Option<T>>, SurfaceError> {
    let mesh = rest.mesh();
    let deformed = Surface::new(mesh, deformed)?;
    let mut has_area = FaceMap::filled(mesh.num_faces(), true);
    for shape in [rest, &deformed] {
        let degenerate = shape.degenerate_faces(scalar(1e-9));
        degenerate.into_iter().for_each(|f| has_area[f] = false);
    }
    Ok(maps::filled(mesh.num_edges(), |e: EdgeId| {
        let is_measured = |h| mesh.face(h).is_some_and(|f| has_area[f]);
        e.halfedges().into_iter().all(is_measured).then(|| {
            let [before, after] = [rest, &deformed].map(|shape| dihedral_angle(shape, e));
            (after - before).abs()
        })
    }))
}

/// The faces that the deformation folded over, in ascending order.
///
/// A face is folded in an embedding if its area vector has a negative dot product with the sum of
/// the area vectors of the faces across its edges, that is, if it faces away from its
/// surroundings. The result lists the faces that are folded in the deformed embedding but not at
/// rest. The crest of a crease sharper than 90° may be listed as well. Faces without area or
/// without neighbours are never listed.
///
/// # Errors
/// [`SurfaceError`] if `deformed` does not embed the mesh.
pub fn folded_faces<T: Scalar>(
    rest: &Surface<'_, T>,
    deformed: &Positions<T>,
) -> Result<Vec<FaceId>, SurfaceError> {
    let mesh = rest.mesh();
    let after = face_area_vectors(&Surface::new(mesh, deformed)?);
    let before = face_area_vectors(rest);
    let is_folded = |vectors: &cotan_halfedge::FaceMap<Vector3<T>>, f: FaceId| {
        vectors[f].dot(&neighbour_sum(mesh, vectors, f)) < T::zero()
    };
    Ok(mesh
        .faces()
        .filter(|&f| is_folded(&after, f) && !is_folded(&before, f))
        .collect())
}

/// The sum of the area vectors of the faces across the edges of `face`.
fn neighbour_sum<T: Scalar>(
    mesh: &HalfedgeMesh,
    vectors: &cotan_halfedge::FaceMap<Vector3<T>>,
    face: FaceId,
) -> Vector3<T> {
    mesh.face_halfedges(face)
        .filter_map(|h| mesh.face(h.twin()))
        .fold(Vector3::zeros(), |sum, f| sum + vectors[f])
}

fn summarize<T: Scalar>(ratios: impl Iterator<Item = Option<T>>) -> Distortion<T> {
    let mut squares = 0.0;
    let mut range: Option<(T, T)> = None;
    let (mut num_compared, mut num_skipped) = (0, 0);
    for ratio in ratios {
        let Some(ratio) = ratio else {
            num_skipped += 1;
            continue;
        };
        num_compared += 1;
        squares += (ratio.as_f64() - 1.0).powi(2);
        range = Some(range.map_or((ratio, ratio), |(lo, hi)| (lo.min(ratio), hi.max(ratio))));
    }
    // If nothing can be compared, nothing is distorted.
    let (min_ratio, max_ratio) = range.unwrap_or((T::one(), T::one()));
    let rms = T::of_f64((squares / num_compared.max(1) as f64).sqrt());
    Distortion {
        rms,
        min_ratio,
        max_ratio,
        num_compared,
        num_skipped,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{bar, bumpy_plane, icosphere};
    use crate::testing;
    use cotan_halfedge::VertexId;
    use nalgebra::Point3;
    use proptest::prelude::*;

    #[test]
    fn stretching_a_bar_stretches_its_long_edges() {
        let shape = bar::<f64>([1.0, 1.0, 4.0], [1, 1, 4]);
        let longer = shape.positions().map(|p| Point3::new(p.x, p.y, 2.0 * p.z));
        let distortion = edge_distortion(&shape.surface(), &longer).expect("same mesh");
        assert_eq!((distortion.min_ratio, distortion.max_ratio), (1.0, 2.0));
        assert_eq!(distortion.num_compared, shape.connectivity().num_edges());
        let areas = area_distortion(&shape.surface(), &longer).expect("same mesh");
        assert_eq!((areas.min_ratio, areas.max_ratio), (1.0, 2.0));
        assert!(angle_distortion_rms(&shape.surface(), &longer).expect("same mesh") > 0.1);
    }

    #[test]
    fn a_hinge_changes_by_the_angle_that_it_is_turned_by() {
        let hinge = |degrees: f64| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let corners = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]];
            let points = corners.into_iter().chain([[cosine, 0.0, sine]]);
            points.map(Point3::from).collect::<Positions<f64>>()
        };
        let mesh = HalfedgeMesh::from_faces(4, &[[0, 1, 2], [1, 0, 3]]).expect("a hinge");
        let flat = hinge(0.0);
        let change = |from: &Positions<f64>, to: &Positions<f64>| {
            let rest = Surface::new(&mesh, from).expect("a surface");
            let changes = dihedral_changes(&rest, to).expect("same mesh");
            let measured: Vec<f64> = changes.values().flatten().copied().collect();
            assert!(measured.len() <= 1, "the boundary has no angle");
            measured.first().map(|c| c.to_degrees())
        };
        for degrees in [-170.0, -30.0, 0.0, 45.0, 120.0, 179.0] {
            let found = change(&flat, &hinge(degrees)).expect("two faces");
            assert!((found - f64::abs(degrees)).abs() < 1e-10, "{found}");
        }
        let through_flat = change(&hinge(-170.0), &hinge(170.0)).expect("two faces");
        assert!((through_flat - 340.0).abs() < 1e-10, "{through_flat}");
        let mut collapsed = flat.clone();
        collapsed[VertexId::new(3)] = collapsed[VertexId::new(0)];
        assert_eq!(change(&flat, &collapsed), None);
        assert_eq!(change(&collapsed, &flat), None);
    }

    #[test]
    fn edges_without_length_are_skipped_and_counted() {
        let shape = icosphere::<f64>(1);
        let [a, b] = shape
            .connectivity()
            .edge_vertices(cotan_halfedge::EdgeId::new(0));
        let mut collapsed = shape.positions().clone();
        collapsed[a] = collapsed[b];
        let rest = shape.surface().with_positions(&collapsed);
        let distortion = edge_distortion(&rest, shape.positions()).expect("same mesh");
        assert_eq!(distortion.num_skipped, 1);
        assert!(distortion.rms.is_finite());
        assert_eq!(
            area_distortion(&rest, shape.positions())
                .expect("same mesh")
                .num_skipped,
            2
        );
    }

    #[test]
    fn a_vertex_pulled_across_its_ring_folds_faces() {
        let shape = bumpy_plane::<f64>([1.0; 2], [10, 10], 0.0);
        let surface = shape.surface();
        let v = shape
            .connectivity()
            .vertices()
            .find(|&v| shape.positions()[v].coords.norm() < 1e-9);
        let v = v.expect("the grid has a middle");
        let mut pulled = shape.positions().clone();
        pulled[v].x += 0.25;
        let folded = folded_faces(&surface, &pulled).expect("same mesh");
        assert!(!folded.is_empty() && folded.len() < 9);
        assert!(
            folded_faces(&surface, shape.positions())
                .expect("same mesh")
                .is_empty()
        );
        // Faces that were already folded at rest are not attributed to the deformation.
        let rest = surface.with_positions(&pulled);
        assert!(folded_faces(&rest, &pulled).expect("same mesh").is_empty());
    }

    #[test]
    fn wrong_positions_are_refused() {
        let shape = icosphere::<f64>(0);
        let mut broken = shape.positions().clone();
        broken[VertexId::new(3)].x = f64::NAN;
        let result = edge_distortion(&shape.surface(), &broken);
        assert_eq!(
            result,
            Err(SurfaceError::NonFinite {
                vertex: VertexId::new(3)
            })
        );
        assert!(folded_faces(&shape.surface(), &Positions::default()).is_err());
    }

    proptest! {
        #[test]
        fn rigid_motions_distort_nothing(
            shape in testing::surfaces(),
            motion in testing::rigid_motions(),
        ) {
            let surface = shape.surface();
            let moved = shape.positions().map(|p| motion * p);
            prop_assert!(edge_distortion_rms(&surface, &moved)? < 1e-10);
            prop_assert!(area_distortion(&surface, &moved)?.rms < 1e-9);
            prop_assert!(angle_distortion_rms(&surface, &moved)? < 1e-9);
            prop_assert!(folded_faces(&surface, &moved)?.is_empty());
        }

        #[test]
        fn scaling_keeps_angles_only(shape in testing::surfaces(), scale in 0.1..10.0_f64) {
            let surface = shape.surface();
            let scaled = shape.positions().map(|p| p * scale);
            prop_assert!((edge_distortion_rms(&surface, &scaled)? - (scale - 1.0).abs()).abs() < 1e-9);
            prop_assert!(angle_distortion_rms(&surface, &scaled)? < 1e-9);
        }
    }
}
