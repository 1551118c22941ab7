//! Proptest strategies for random surfaces and motions, for the property tests of all crates.
//!
//! Requires the feature `testing`. All shapes are valid triangle meshes without degenerate faces,
//! in double precision; [`rounded`] converts them to another scalar type.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use crate::mesh::Mesh;
use crate::scalar::Scalar;
use crate::shapes::{bar, bumpy_plane, cylinder, icosphere, tetrahedron, torus};

/// A small surface of any kind with at most 400 vertices: closed (genus 0 or 1) or a disc,
/// regular or jittered by up to a tenth of the shortest edge, with random position, rotation and
/// scale (0.1 … 10).
pub fn surfaces() -> impl Strategy<Value = Mesh<f64>> {
    place(prop_oneof![closed_shapes(), discs()])
}

/// Like [`surfaces`], but closed: genus 0 or 1.
pub fn closed_surfaces() -> impl Strategy<Value = Mesh<f64>> {
    place(closed_shapes())
}

/// Like [`surfaces`], but closed and of genus 0.
pub fn spheres() -> impl Strategy<Value = Mesh<f64>> {
    place(genus_zero_shapes())
}

/// Like [`surfaces`], but with one boundary loop.
pub fn open_surfaces() -> impl Strategy<Value = Mesh<f64>> {
    place(discs())
}

/// An icosphere whose radius varies smoothly by up to 40 %, with a mean of about 1.
pub fn blobs() -> impl Strategy<Value = Mesh<f64>> {
    let wave = (directions(), 0.5..3.0_f64, 0.0..TAU);
    (
        0..3_u32,
        proptest::collection::vec(wave, 1..4),
        0.0..0.4_f64,
    )
        .prop_map(|(subdivisions, waves, depth)| {
            let mut shape = icosphere::<f64>(subdivisions);
            let share = depth / waves.len() as f64;
            for p in shape.positions_mut().iter_mut() {
                let height: f64 = waves
                    .iter()
                    .map(|(axis, frequency, phase)| (frequency * axis.dot(&p.coords) + phase).sin())
                    .sum();
                *p *= 1.0 + share * height;
            }
            shape
        })
}

/// The meshes of a strategy with positions rounded to `T`. They shrink in the same way.
///
/// ```
/// use cotan_geometry::testing::{rounded, surfaces};
/// use proptest::prelude::*;
///
/// proptest!(|(mesh in rounded::<f32>(surfaces()))| {
///     prop_assert!(mesh.surface().area() > 0.0);
/// });
/// ```
pub fn rounded<T: Scalar>(
    meshes: impl Strategy<Value = Mesh<f64>>,
) -> impl Strategy<Value = Mesh<T>> {
    meshes.prop_map(|mesh| mesh.cast())
}

/// A rotation about a random axis by 0 … π.
pub fn rotations() -> impl Strategy<Value = Rotation3<f64>> {
    (directions(), 0.0..PI).prop_map(|(axis, angle)| Rotation3::new(axis * angle))
}

/// A rotation followed by a translation by up to 10 along each axis.
pub fn rigid_motions() -> impl Strategy<Value = Isometry3<f64>> {
    (rotations(), [-10.0..10.0_f64, -10.0..10.0, -10.0..10.0]).prop_map(|(rotation, offset)| {
        let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
        Isometry3::from_parts(Translation3::from(Vector3::from(offset)), rotation)
    })
}

/// A uniformly distributed unit vector.
pub fn directions() -> impl Strategy<Value = Vector3<f64>> {
    (-1.0..1.0_f64, 0.0..TAU).prop_map(|(z, angle)| {
        let radius = (1.0 - z * z).max(0.0).sqrt();
        Vector3::new(radius * angle.cos(), radius * angle.sin(), z)
    })
}

fn genus_zero_shapes() -> impl Strategy<Value = Mesh<f64>> {
    prop_oneof![
        Just(tetrahedron()),
        (0..3_u32).prop_map(icosphere),
        (0.5..2.0_f64, 1..3_usize, 1..12_usize).prop_map(|(height, sixths, stacks)| cylinder(
            0.5,
            height,
            6 * sixths,
            stacks
        )),
        ([0.5..2.0_f64, 0.5..2.0, 0.5..2.0], [1..5_usize, 1..5, 1..5])
            .prop_map(|(size, segments)| bar(size, segments)),
        blobs(),
    ]
}

fn closed_shapes() -> impl Strategy<Value = Mesh<f64>> {
    let tori = (0.2..0.6_f64, 6..24_usize, 5..14_usize)
        .prop_map(|(minor, around, across)| torus(1.0, minor, around, across));
    prop_oneof![3 => genus_zero_shapes(), 1 => tori]
}

fn discs() -> impl Strategy<Value = Mesh<f64>> {
    ([0.5..2.0_f64, 0.5..2.0], [2..12_usize, 2..12], 0.0..0.2_f64)
        .prop_map(|(size, segments, amplitude)| bumpy_plane(size, segments, amplitude))
}

/// Jitters, scales, rotates and translates the shapes.
fn place(shapes: impl Strategy<Value = Mesh<f64>>) -> impl Strategy<Value = Mesh<f64>> {
    let jitter = prop_oneof![Just(0.0), 0.0..0.1_f64];
    (shapes, jitter, any::<u64>(), -1.0..1.0_f64, rigid_motions()).prop_map(
        |(mut shape, jitter, seed, exponent, motion)| {
            let reach = jitter * shortest_edge(&shape);
            let scale = 10.0_f64.powf(exponent);
            for (v, p) in shape.positions_mut().iter_mut().enumerate() {
                let noise = Vector3::from_fn(|k, _| noise(seed, 3 * v + k));
                *p = motion * Point3::from((p.coords + noise * reach) * scale);
            }
            shape
        },
    )
}

fn shortest_edge(shape: &Mesh<f64>) -> f64 {
    shape
        .surface()
        .edge_lengths()
        .values()
        .copied()
        .fold(f64::INFINITY, f64::min)
}

/// A number in −1 … 1 that depends only on `seed` and `index` (the mixer of SplitMix64).
fn noise(seed: u64, index: usize) -> f64 {
    let mut z = seed.wrapping_add((index as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    (z ^ (z >> 31)) as f64 / u64::MAX as f64 * 2.0 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    proptest! {
        #[test]
        fn surfaces_are_small_and_sound(shape in surfaces()) {
            prop_assert!(shape.num_vertices() <= 400);
            prop_assert!(shape.surface().degenerate_faces(1e-3).is_empty());
        }

        #[test]
        fn single_precision_keeps_surfaces_sound(shape in rounded::<f32>(surfaces())) {
            prop_assert!(shape.surface().degenerate_faces(1e-3).is_empty());
        }

        #[test]
        fn kinds_have_their_boundaries(
            closed in closed_surfaces(),
            sphere in spheres(),
            open in open_surfaces(),
        ) {
            let boundary = |shape: &Mesh<f64>| {
                shape.connectivity().halfedges().filter(|&h| shape.connectivity().is_boundary_halfedge(h)).count()
            };
            prop_assert_eq!(boundary(&closed), 0);
            prop_assert_eq!(boundary(&sphere), 0);
            prop_assert!(boundary(&open) >= 8);
            let mesh = sphere.connectivity();
            prop_assert_eq!(mesh.num_vertices() + mesh.num_faces(), mesh.num_edges() + 2);
        }

        #[test]
        fn motions_keep_lengths(motion in rigid_motions(), rotation in rotations()) {
            let step = motion * Vector3::new(1.0, 2.0, 2.0);
            prop_assert!((step.norm() - 3.0).abs() < 1e-12);
            prop_assert!((rotation.matrix().determinant() - 1.0).abs() < 1e-12);
        }
    }
}
