//! Texture coordinates from longitude and latitude, cut along the ±180° meridian.

use std::f64::consts::{PI, TAU};

use cotan_geometry::Scalar;
use cotan_halfedge::{FaceId, FaceMap};
use nalgebra::Vector3;

use super::locate::{Place, place};
use super::map::SphereMap;

/// Texture coordinates of each corner, with a cut where they cannot be continuous.
///
/// The u coordinates of two corners at the same vertex may differ by an integer along the cut,
/// and by any amount at a pole.
#[derive(Clone, PartialEq, Debug)]
pub struct CornerUvs<T: Scalar> {
    /// (u, v) of the corners of each face, in the order of
    /// [`HalfedgeMesh::triangle`](cotan_halfedge::HalfedgeMesh::triangle).
    pub corners: FaceMap<[[T; 2]; 3]>,
    /// Faces with a pole inside or on an edge, in ascending order; at most four. Their texture is
    /// stretched, because a pole is a whole line of the texture. There are none if vertices lie
    /// at the poles, which [`SphereMap::orient_landmarks`] achieves for one pole.
    pub pole_faces: Vec<FaceId>,
}

impl<T: Scalar> CornerUvs<T> {
    /// Converts to a table of distinct coordinates with an index per corner, the form used by
    /// file formats.
    #[must_use]
    pub fn indexed(&self, map: &SphereMap<T>) -> (Vec<[T; 2]>, Vec<[u32; 3]>) {
        let mut table = Vec::new();
        // Table indices used at each vertex: usually one, two along the cut.
        let mut at_vertex = vec![Vec::<u32>::new(); map.mesh().num_vertices()];
        let faces = self.corners.iter().map(|(f, uvs)| {
            let corners = map.mesh().triangle(f);
            [0, 1, 2].map(|k| {
                let known = &mut at_vertex[corners[k].index()];
                let same = known.iter().copied().find(|&i| table[i as usize] == uvs[k]);
                same.unwrap_or_else(|| {
                    let number = table.len() as u32;
                    table.push(uvs[k]);
                    known.push(number);
                    number
                })
            })
        });
        let faces = faces.collect();
        (table, faces)
    }
}

impl<T: Scalar> SphereMap<T> {
    /// Texture coordinates of an equirectangular image: u = ½ + longitude / 2π, v = ½ + latitude
    /// / π, with longitude = atan2(y, x) and latitude = asin z. v points up, as in OBJ.
    ///
    /// No face wraps around the image. If a face crosses the meridian at ±180°, its corners east
    /// of it get u + 1. Therefore u lies in 0 … 1 except for these faces, whose u exceeds 1 (the
    /// texture should repeat in u). A corner at a pole gets the mean u of the other two. In a
    /// face around a pole, u continues from corner to corner, and the face is listed in
    /// [`CornerUvs::pole_faces`].
    ///
    /// **Shapes**: three pairs per face. **Units**: fractions of the image's width and height.
    #[must_use]
    pub fn longitude_latitude(&self) -> CornerUvs<T> {
        let mut pole_faces = Vec::new();
        let corners = self.mesh().faces().map(|face| {
            let corners = self.corners(face);
            let at_pole = corners.iter().any(is_pole);
            let pole = |z: f64| place(&corners, &Vector3::new(0.0, 0.0, z)) != Place::Outside;
            if !at_pole && (pole(1.0) || pole(-1.0)) {
                pole_faces.push(face);
            }
            corner_uvs(&corners).map(|uv| uv.map(T::of_f64))
        });
        CornerUvs {
            corners: corners.collect(),
            pole_faces,
        }
    }
}

/// (u, v) of three corners, where each u is within ½ of the previous one.
fn corner_uvs(corners: &[Vector3<f64>; 3]) -> [[f64; 2]; 3] {
    let mut us = corners.map(|p| 0.5 + p.y.atan2(p.x) / TAU);
    let ordinary: Vec<usize> = (0..3).filter(|&k| !is_pole(&corners[k])).collect();
    for pair in ordinary.windows(2) {
        let step = us[pair[1]] - us[pair[0]];
        us[pair[1]] -= step.round();
    }
    let lowest = ordinary
        .iter()
        .map(|&k| us[k])
        .fold(f64::INFINITY, f64::min);
    // The image starts at 0; a face that only touches its right end stays there.
    let shift = match () {
        () if lowest < 0.0 => 1.0,
        () if lowest >= 1.0 => -1.0,
        () => 0.0,
    };
    for &k in &ordinary {
        us[k] += shift;
    }
    let mean = ordinary.iter().map(|&k| us[k]).sum::<f64>() / ordinary.len() as f64;
    [0, 1, 2].map(|k| {
        let p = &corners[k];
        let u = if is_pole(p) { mean } else { us[k] };
        // atan2 keeps the digits near the poles, where asin loses half of them.
        [u, 0.5 + p.z.atan2(p.x.hypot(p.y)) / PI]
    })
}

fn is_pole(p: &Vector3<f64>) -> bool {
    p.x == 0.0 && p.y == 0.0
}

#[cfg(test)]
mod tests {
    use cotan_geometry::icosphere;
    use cotan_geometry::testing::rotations;
    use nalgebra::Rotation3;
    use proptest::prelude::*;

    use super::*;

    fn check<T: Scalar>(map: &SphereMap<T>, tolerance: f64) {
        let uvs = map.longitude_latitude();
        assert!(uvs.pole_faces.len() <= 4);
        for (f, corners) in uvs.corners.iter() {
            let corners = corners.map(|uv| uv.map(T::as_f64));
            let points = map.corners(f);
            for ([u, v], p) in corners.iter().zip(&points) {
                let (longitude, latitude) = ((u - 0.5) * TAU, (v - 0.5) * PI);
                assert!(
                    (-1e-9..2.0).contains(u) && (0.0..=1.0).contains(v),
                    "{u} {v}"
                );
                let (x, y) = (
                    longitude.cos() * latitude.cos(),
                    longitude.sin() * latitude.cos(),
                );
                assert!((Vector3::new(x, y, latitude.sin()) - p).norm() < tolerance);
            }
            if uvs.pole_faces.binary_search(&f).is_err() {
                let us = corners.map(|[u, _]| u);
                let span = us.iter().fold(0.0_f64, |s, u| s.max((u - us[0]).abs()));
                assert!(span <= 0.5 + 1e-9, "{us:?}");
                assert!(us.iter().any(|&u| u < 1.0 + 1e-9));
            }
        }
    }

    proptest! {
        #[test]
        fn uvs_name_the_points_and_no_face_wraps(turn in rotations(), level in 0..4_u32) {
            let shape = icosphere::<f64>(level);
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            check(&map.rotated(&turn).unwrap(), 1e-13);
            let single = icosphere::<f32>(level);
            let map = SphereMap::new(single.connectivity(), single.positions().clone()).unwrap();
            check(&map.rotated(&turn).unwrap(), 1e-5);
        }

        #[test]
        fn corners_at_a_vertex_differ_by_whole_turns(turn in rotations()) {
            let shape = icosphere::<f64>(3);
            let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
            let map = map.rotated(&turn).unwrap();
            let uvs = map.longitude_latitude();
            let (table, faces) = uvs.indexed(&map);
            let mut first = vec![None; shape.num_vertices()];
            for (f, numbers) in faces.iter().enumerate() {
                let face = FaceId::new(f);
                for k in 0..3 {
                    let uv = table[numbers[k] as usize];
                    prop_assert_eq!(uv, uvs.corners[face][k]);
                    let v = shape.connectivity().triangle(face)[k];
                    let [u, _] = *first[v.index()].get_or_insert(uv);
                    let step: f64 = uv[0] - u;
                    prop_assert!((step - step.round()).abs() < 1e-12);
                }
            }
            // The cut is a single line from pole to pole, so few vertices are duplicated.
            prop_assert!(table.len() < 642 + 80, "{}", table.len());
        }
    }

    #[test]
    fn a_vertex_at_a_pole_leaves_no_pole_face_there() {
        let shape = icosphere::<f64>(2);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        // The axes pass through edge midpoints of the icosahedron, and through vertices from
        // level 1 on.
        let poles = map.positions().values().filter(|p| is_pole(&p.coords));
        assert_eq!(poles.count(), 2);
        let uvs = map.longitude_latitude();
        assert!(uvs.pole_faces.is_empty());
        // After a slight rotation there is one face around each pole, or two at an edge.
        let map = map
            .rotated(&Rotation3::new(Vector3::new(0.05, 0.02, 0.0)))
            .unwrap();
        assert_eq!(map.longitude_latitude().pole_faces.len(), 2);
    }

    #[test]
    fn a_face_at_the_cut_stays_on_its_side() {
        let at = |degrees: f64, z: f64| {
            let angle = degrees.to_radians();
            Vector3::new(angle.cos(), angle.sin(), z).normalize()
        };
        let us = |degrees: [f64; 3]| {
            let [a, b, c] = degrees.map(|d| (d, if d == degrees[0] { 0.1 } else { 0.0 }));
            corner_uvs(&[a, b, c].map(|(d, z)| at(d, z))).map(|[u, _]| (u * 360.0).round())
        };
        assert_eq!(us([170.0, 190.0, 175.0]), [350.0, 370.0, 355.0]);
        assert_eq!(us([190.0, 170.0, 175.0]), [370.0, 350.0, 355.0]);
        assert_eq!(us([-170.0, -160.0, -165.0]), [10.0, 20.0, 15.0]);
        assert_eq!(us([180.0, 170.0, 175.0]), [360.0, 350.0, 355.0]);
        let exact = Vector3::new(-1.0, 0.0, 0.0);
        let east = corner_uvs(&[exact, at(-170.0, 0.0), at(-175.0, 0.1)]);
        assert_eq!(east[0][0], 0.0);
        let west = corner_uvs(&[exact, at(175.0, 0.1), at(170.0, 0.0)]);
        assert_eq!(west[0][0], 1.0);
    }
}
