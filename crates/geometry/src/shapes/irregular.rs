//! Closed meshes of any size without an underlying grid, so that measurements on them are
//! representative.

use std::f64::consts::{PI, TAU};

use cotan_halfedge::{EdgeId, HalfedgeMesh, VertexId};
use nalgebra::{Point3, Vector3};

use super::geodesic::geodesic;
use crate::angles::triangle_cotangents;
use crate::mesh::Mesh;
use crate::scalar::Scalar;

/// The order of the vertices and faces of [`irregular`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum VertexOrder {
    /// Random order, as scanners and converters may leave it. The slowest case.
    #[default]
    Random,
    /// Row by row, so that neighbours have nearby indices.
    Natural,
}

/// A closed surface of genus 0 with irregularly placed vertices and valences from 3 to 12, for
/// measurements.
///
/// It has 10·f² + 2 vertices, for the f that comes closest to `num_vertices` (from 12 to 16
/// million). The points of a geodesic sphere are displaced on it, edges are flipped towards a
/// Delaunay triangulation and then some more at random, and the radius is modulated by a few long
/// waves. The same `seed` gives the same mesh.
///
/// ```
/// use cotan_geometry::shapes::{VertexOrder, irregular};
/// let shape = irregular::<f64>(1_000, VertexOrder::Random, 7);
/// assert_eq!(shape.num_vertices(), 1_002);
/// ```
#[must_use]
pub fn irregular<T: Scalar>(num_vertices: usize, numbering: VertexOrder, seed: u64) -> Mesh<T> {
    let frequency = (num_vertices.saturating_sub(2) as f64 / 10.0)
        .sqrt()
        .round();
    let (mut points, faces) = geodesic((frequency as usize).clamp(1, MAX_FREQUENCY));
    let chance = Chance(seed);
    let spacing = (4.0 * PI / points.len() as f64).sqrt();
    for (i, p) in points.iter_mut().enumerate() {
        let step = Vector3::from_fn(|k, _| chance.unit(i as u64, k as u64) - 0.5);
        *p = (*p + step * (JITTER * spacing)).normalize();
    }
    let mut mesh = connect(points.len(), &faces);
    drop(faces);
    let mut valences: Vec<u8> = mesh.vertices().map(|v| mesh.valence(v) as u8).collect();
    for _ in 0..DELAUNAY_PASSES {
        flip(&mut mesh, &points, &mut valences, |_, weight| weight < 0.0);
    }
    flip(&mut mesh, &points, &mut valences, |e, weight| {
        weight < HEAVIEST && chance.unit(e.index() as u64, 3) < RANDOM_FLIPS
    });
    drop(valences);
    swell(&mut points, chance);
    number(mesh, points, numbering, chance)
}

/// Flips each edge accepted by `wanted`, which receives the edge's cotangent weight, if both new
/// triangles face outwards and are not needles and the valences stay within bounds.
fn flip(
    mesh: &mut HalfedgeMesh,
    points: &[Vector3<f64>],
    valences: &mut [u8],
    wanted: impl Fn(EdgeId, f64) -> bool,
) {
    let place = |v: VertexId| Point3::from(points[v.index()]);
    for e in (0..mesh.num_edges()).map(EdgeId::new) {
        let [h, twin] = e.halfedges();
        let corners = [
            mesh.origin(h),
            mesh.target(h),
            mesh.target(mesh.next(h)),
            mesh.target(mesh.next(twin)),
        ];
        let [u, v, c, d] = corners;
        let [at_u, at_v, at_c, at_d] = corners.map(place);
        let weight = triangle_cotangents(&at_c, &at_u, &at_v)[0]
            + triangle_cotangents(&at_d, &at_v, &at_u)[0];
        let valence = |v: VertexId| valences[v.index()];
        let is_open = valence(u) > FEWEST && valence(v) > FEWEST;
        if !wanted(e, weight) || !is_open || valence(c) >= MOST || valence(d) >= MOST {
            continue;
        }
        let is_good = |a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>| {
            let outwards = (b - a).cross(&(c - a)).dot(&a.coords) > 0.0;
            outwards && triangle_cotangents(a, b, c).iter().all(|&x| x < SHARPEST)
        };
        let is_fine = is_good(&at_c, &at_u, &at_d) && is_good(&at_d, &at_v, &at_c);
        if is_fine && mesh.flip_edge(e).is_ok() {
            [u, v].iter().for_each(|v| valences[v.index()] -= 1);
            [c, d].iter().for_each(|v| valences[v.index()] += 1);
        }
    }
}

/// Scales each point by 1 plus a few waves.
fn swell(points: &mut [Vector3<f64>], chance: Chance) {
    let waves: Vec<(Vector3<f64>, f64)> = (0..WAVES)
        .map(|w| {
            let direction = Vector3::from_fn(|k, _| 2.0 * chance.unit(w, 4 + k as u64) - 1.0);
            (direction * SHORTEST_WAVE, TAU * chance.unit(w, 7))
        })
        .collect();
    for p in points {
        let wave = |(k, phase): &(Vector3<f64>, f64)| (k.dot(p) + phase).sin();
        *p *= 1.0 + WAVE_HEIGHT * waves.iter().map(wave).sum::<f64>();
    }
}

/// Puts the shape into its final order.
fn number<T: Scalar>(
    mesh: HalfedgeMesh,
    points: Vec<Vector3<f64>>,
    numbering: VertexOrder,
    chance: Chance,
) -> Mesh<T> {
    let round = |p: &Vector3<f64>| Point3::from(p.map(T::of_f64));
    if numbering == VertexOrder::Natural {
        let positions = points.iter().map(round).collect();
        return Mesh::assume_checked(mesh, positions);
    }
    let old = chance.permutation(points.len(), 8);
    let mut new = vec![0; points.len()];
    for (k, &v) in old.iter().enumerate() {
        new[v as usize] = k as u32;
    }
    let faces: Vec<[u32; 3]> = chance
        .permutation(mesh.num_faces(), 9)
        .into_iter()
        .map(|f| mesh.triangle(cotan_halfedge::FaceId::new(f as usize)))
        .map(|corners| corners.map(|v| new[v.index()]))
        .collect();
    drop((mesh, new));
    Mesh::assume_checked(
        connect(points.len(), &faces),
        old.iter().map(|&v| round(&points[v as usize])).collect(),
    )
}

fn connect(num_vertices: usize, faces: &[[u32; 3]]) -> HalfedgeMesh {
    match HalfedgeMesh::from_faces(num_vertices, faces) {
        Ok(mesh) => mesh,
        // The faces are generated here, so this is a broken invariant of this file.
        Err(error) => panic!("a sample shape is no manifold: {error}"),
    }
}

/// Random numbers keyed by index and purpose, independent of the order of calls (SplitMix64).
#[derive(Clone, Copy)]
struct Chance(u64);

impl Chance {
    fn bits(self, place: u64, purpose: u64) -> u64 {
        let mut z = self
            .0
            .wrapping_mul(0xd134_2543_de82_ef95)
            .wrapping_add(place.wrapping_mul(0x9e37_79b9_7f4a_7c15))
            .wrapping_add(purpose << 56);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in [0, 1).
    fn unit(self, place: u64, purpose: u64) -> f64 {
        (self.bits(place, purpose) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A shuffled permutation of the indices below `len` (Fisher and Yates).
    fn permutation(self, len: usize, purpose: u64) -> Vec<u32> {
        let mut numbers: Vec<u32> = (0..len as u32).collect();
        for last in (1..len).rev() {
            let other = self.bits(last as u64, purpose) % (last as u64 + 1);
            numbers.swap(last, other as usize);
        }
        numbers
    }
}

/// 16,000,002 vertices.
const MAX_FREQUENCY: usize = 1265;

/// Side of the cube in which a point is displaced, relative to the mean distance between points.
/// Large enough to erase the grid.
const JITTER: f64 = 0.9;

/// After three passes there are hardly any flips left.
const DELAUNAY_PASSES: usize = 3;

/// The fraction of eligible edges that are flipped at random.
const RANDOM_FLIPS: f64 = 0.2;

/// The largest cotangent weight at which an edge may be flipped at random.
const HEAVIEST: f64 = 0.5;

/// Cotangent of the smallest angle that a flip may create, 7°.
const SHARPEST: f64 = 8.0;

const FEWEST: u8 = 3;
const MOST: u8 = 12;

const WAVES: u64 = 6;
/// The largest wave number. Its product with the height stays below 1, so the surface is
/// star-shaped and smooth.
const SHORTEST_WAVE: f64 = 4.0;
const WAVE_HEIGHT: f64 = 0.06;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{negative_cotangent_share, volume};

    #[test]
    fn it_is_a_closed_irregular_blob() {
        for numbering in [VertexOrder::Random, VertexOrder::Natural] {
            let shape = irregular::<f64>(4_000, numbering, 1);
            let mesh = shape.connectivity();
            assert_eq!(mesh.num_vertices(), 10 * 20 * 20 + 2);
            assert_eq!(mesh.num_faces(), 2 * mesh.num_vertices() - 4);
            assert!(mesh.halfedges().all(|h| !mesh.is_boundary_halfedge(h)));
            let valences: Vec<usize> = mesh.vertices().map(|v| mesh.valence(v)).collect();
            let (least, most) = (valences.iter().min(), valences.iter().max());
            assert!(least >= Some(&3) && most <= Some(&12), "{least:?} {most:?}");
            let is_six = valences.iter().filter(|&&v| v == 6).count();
            assert!(2 * is_six < mesh.num_vertices(), "{is_six}");
            let surface = shape.surface();
            assert!(volume(&surface) > 3.0);
            let share = negative_cotangent_share(&surface);
            assert!(share > 0.0 && share < 0.2, "{share}");
        }
    }

    #[test]
    fn the_seed_says_it_all() {
        let blob = |seed| irregular::<f32>(300, VertexOrder::Random, seed);
        assert_eq!(blob(5), blob(5));
        assert_ne!(blob(5), blob(6));
        assert_eq!(
            irregular::<f32>(0, VertexOrder::Natural, 0)
                .positions()
                .len(),
            12
        );
    }

    #[test]
    fn both_numberings_are_of_one_surface() {
        let volume_of = |numbering| volume(&irregular::<f64>(1_000, numbering, 3).surface());
        let [random, natural] = [VertexOrder::Random, VertexOrder::Natural].map(volume_of);
        assert!((random / natural - 1.0).abs() < 1e-12);
    }
}
