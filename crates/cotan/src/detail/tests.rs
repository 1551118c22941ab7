use cotan_geometry::shapes::{bumpy_plane, icosphere, torus};
use cotan_geometry::testing::{blobs, rigid_motions};
use cotan_geometry::{Mesh, Positions, Scalar, folded_faces};
use cotan_halfedge::{VertexId, VertexMap};
use nalgebra::{Point3, Rotation3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::merge::Similarity;
use crate::smooth::{Boundary, GaussianNoise, Mask, Preserve, curvature_field};
use crate::sphere::SphereMap;

/// A shape on the sphere: the directions of its vertices, and the vertices.
struct OnSphere {
    map: SphereMap<f64>,
    shape: Mesh<f64>,
}

impl OnSphere {
    /// A sphere of a level, turned and with its vertices scattered over the sphere by a share of
    /// an edge, and its image.
    fn new(level: u32, scatter: f64, image: impl Fn(&Vector3<f64>) -> Point3<f64>) -> Self {
        let sphere = icosphere::<f64>(level);
        let mut noise = GaussianNoise::new(7);
        let edge = scatter * sphere.surface().mean_edge_length();
        let turn = Rotation3::new(Vector3::new(0.3, -0.2, 0.7) * f64::from(level));
        let directions: Positions<f64> = sphere
            .positions()
            .values()
            .map(|p| {
                let aside = Vector3::from_fn(|_, _| noise.next().unwrap_or(0.0).clamp(-2.0, 2.0));
                Point3::from((turn * (p.coords + aside * edge)).normalize())
            })
            .collect();
        let positions = directions.map(|p| image(&p.coords));
        Self {
            map: SphereMap::new(sphere.connectivity(), directions).unwrap(),
            shape: sphere.with_positions(positions).unwrap(),
        }
    }
}

/// Bumps of the width of a twenty-fourth of the circumference and of a height of about 1: three
/// spherical harmonics of degree 12, which have no part of longer waves.
fn bumps(u: &Vector3<f64>) -> f64 {
    let turns = [
        Vector3::new(0.2, 0.1, 0.0),
        Vector3::new(1.5, 0.3, 0.1),
        Vector3::new(0.3, 1.4, 0.8),
    ];
    let wave = |turn: &Vector3<f64>| {
        let p = Rotation3::new(*turn) * u;
        nalgebra::Complex::new(p.x, p.y).powi(12).re
    };
    turns.iter().map(wave).sum()
}

/// A blob that is bent: thick in the middle, curved like a banana.
fn blob(u: &Vector3<f64>) -> Point3<f64> {
    let x = 1.7 * u.x;
    Point3::new(x, u.y * (1.0 + 0.2 * u.x) - 0.25 * x * x, 1.2 * u.z)
}

/// A bumpy sphere.
fn bumpy(u: &Vector3<f64>) -> Point3<f64> {
    Point3::from(u * (1.0 + 0.01 * bumps(u)))
}

struct Fit {
    /// The rms distance from the truth over that of the details' heights.
    error: f64,
    /// The correlation of the changes of the mean curvature.
    correlation: f64,
}

/// Transfers the bumps of a sphere to the blob and compares with the bumps that are known there.
fn fit(source: u32, target: u32) -> Fit {
    let source = OnSphere::new(source, 0.1, bumpy);
    let target = OnSphere::new(target, 0.1, blob);
    let (from, to) = bases(&source.shape, &target.shape);
    let map = Correspondence::on_sphere(&source.map, &target.map).unwrap();
    let sampled = Detail::of(&from).unwrap().sample(&map, &to).unwrap();
    let applied = sampled.apply(&to, &ApplyOptions::default()).unwrap();
    assert_eq!(applied.rounds, 0);

    let surface = target.shape.surface();
    let normals = surface.vertex_normals();
    let unit = surface.area().sqrt() / (4.0 * std::f64::consts::PI).sqrt();
    let true_way =
        |v: VertexId| normals[v] * (0.01 * unit * bumps(&target.map.positions()[v].coords));
    let truth: Positions<f64> = surface
        .positions()
        .iter()
        .map(|(v, p)| p + true_way(v))
        .collect();
    let square = |a: &Positions<f64>, b: &Positions<f64>| -> f64 {
        a.values()
            .zip(b.values())
            .map(|(a, b)| (a - b).norm_squared())
            .sum()
    };
    let error = square(&applied.positions, &truth) / square(&truth, surface.positions());
    let curvature = |x: &Positions<f64>| curvature_field(&surface.with_positions(x));
    let own = curvature(surface.positions());
    let changes = [&applied.positions, &truth].map(|x| {
        let pairs = curvature(x).into_vec().into_iter().zip(own.values());
        pairs.map(|(now, own)| now - own).collect::<Vec<f64>>()
    });
    Fit {
        error: error.sqrt(),
        correlation: correlation(&changes[0], &changes[1]),
    }
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (p, q) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        a.iter().zip(b).map(|(x, y)| f(x - p, y - q)).sum()
    };
    sum(&|x, y| x * y) / (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt()
}

/// The bases of both with the same wavelength relative to their sizes.
fn bases<T: Scalar>(a: &Mesh<T>, b: &Mesh<T>) -> (BaseSurface<T>, BaseSurface<T>) {
    let source = BaseSurface::new(a, &BaseOptions::default()).unwrap();
    let options = BaseOptions::default().wavelength(source.wavelength());
    (source, BaseSurface::new(b, &options).unwrap())
}

fn farthest(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
    let pairs = a.values().zip(b.values());
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn known_details_arrive_from_fine_to_coarse_and_back() {
    for [source, target] in [[5, 4], [4, 4], [4, 5]] {
        let Fit { error, correlation } = fit(source, target);
        println!("{source} to {target}: error {error:.3}, correlation {correlation:.4}");
        assert!(error <= 0.25, "{source} to {target}: error {error}");
        assert!(
            correlation >= 0.99,
            "{source} to {target}: correlation {correlation}"
        );
    }
}

#[test]
fn closest_points_find_the_same_details_as_the_sphere() {
    let source = OnSphere::new(5, 0.1, |u| bumpy(u));
    let target = OnSphere::new(4, 0.1, |u| Point3::from(*u));
    let (from, to) = bases(&source.shape, &target.shape);
    let detail = Detail::of(&from).unwrap();
    let by_sphere = Correspondence::on_sphere(&source.map, &target.map).unwrap();
    let by_sphere = detail.sample(&by_sphere, &to).unwrap();
    let identity = Similarity::identity();
    let closest = Correspondence::closest(&from, &to, &identity);
    assert!(closest.points().values().all(Option::is_some));
    let closest = detail.sample(&closest, &to).unwrap();
    let heights = |detail: &Detail| detail.heights().clone().into_vec();
    let same = correlation(&heights(&by_sphere), &heights(&closest));
    assert!(same > 0.99, "{same}");

    // Moved and scaled, and brought back by the placement.
    let moved = source.shape.with_positions(
        source
            .shape
            .positions()
            .map(|p| p * 3.0 + Vector3::new(5.0, 0.0, 1.0)),
    );
    let (moved, _) = bases(&moved.unwrap(), &target.shape);
    let back = Similarity {
        scale: 1.0 / 3.0,
        translation: Vector3::new(-5.0, 0.0, -1.0) / 3.0,
        ..identity
    };
    let placed = Correspondence::closest(&moved, &to, &back);
    let placed = Detail::of(&moved).unwrap().sample(&placed, &to).unwrap();
    for (a, b) in placed.heights().values().zip(closest.heights().values()) {
        assert!((a - b).abs() < 1e-9);
    }
    let far = Correspondence::closest(&moved, &to, &identity);
    assert_eq!(
        detail_error(&Detail::of(&moved).unwrap(), &far, &to),
        DetailError::NothingCovered
    );
}

fn detail_error(detail: &Detail, map: &Correspondence, to: &BaseSurface<f64>) -> DetailError {
    detail.sample(map, to).unwrap_err()
}

#[test]
fn heights_of_zero_change_no_digit() {
    let target = OnSphere::new(3, 0.1, blob).shape;
    let base = BaseSurface::new(&target, &BaseOptions::default()).unwrap();
    let none = Detail::of(&base).unwrap().scaled(0.0);
    let applied = none.apply(&base, &ApplyOptions::default()).unwrap();
    assert_eq!(&applied.positions, target.positions());
    assert_eq!((applied.kept, applied.rounds), (1.0, 0));
    let still = ApplyOptions::default().scale(0.0);
    let own = Detail::of(&base).unwrap().apply(&base, &still).unwrap();
    assert_eq!(&own.positions, target.positions());
    // A plane has no details.
    let flat = bumpy_plane::<f64>([2.0, 1.0], [20, 10], 0.0);
    let detail = Detail::extract(&flat, Wavelength::default()).unwrap();
    let highest = detail
        .heights()
        .values()
        .fold(0.0, |h: f64, x| h.max(x.abs()));
    assert!(highest < 1e-13, "{highest:e}");
}

#[test]
fn a_sphere_has_no_details() {
    let shape = icosphere::<f64>(4);
    let detail = Detail::extract(&shape, Wavelength::Share(0.3)).unwrap();
    let highest = detail
        .heights()
        .values()
        .fold(0.0, |h: f64, x| h.max(x.abs()));
    // The curvature is not exact at the vertices with five neighbours.
    assert!(highest < 2e-4, "{highest:e}");
}

#[test]
fn details_of_any_height_fold_no_face() {
    let source = OnSphere::new(4, 0.1, bumpy);
    let target = OnSphere::new(4, 0.2, blob);
    let (from, to) = bases(&source.shape, &target.shape);
    let map = Correspondence::on_sphere(&source.map, &target.map).unwrap();
    let sampled = Detail::of(&from).unwrap().sample(&map, &to).unwrap();
    let surface = target.shape.surface();
    for scale in [-30.0, -5.0, 1.0, 5.0, 30.0, 1e6] {
        let options = ApplyOptions::default().scale(scale);
        let applied = sampled.apply(&to, &options).unwrap();
        assert!(
            folded_faces(&surface, &applied.positions)
                .unwrap()
                .is_empty(),
            "{scale}"
        );
        let now = surface.with_positions(&applied.positions);
        for f in surface.mesh().faces() {
            assert!(
                surface.face_normal(f).dot(&now.face_normal(f)) >= 0.2 - 1e-9,
                "{scale}"
            );
        }
        assert_eq!(applied.rounds == 0, applied.kept == 1.0);
    }
}

#[test]
fn details_taken_off_leave_the_base() {
    let shape = OnSphere::new(4, 0.1, bumpy).shape;
    let base = BaseSurface::new(&shape, &BaseOptions::default()).unwrap();
    let detail = Detail::of(&base).unwrap();
    let off = detail
        .apply(&base, &ApplyOptions::default().scale(-1.0))
        .unwrap();
    let rough = |x: &Positions<f64>| -> f64 {
        let radii = x.values().map(|p| (p.coords.norm() - 1.0).powi(2));
        (radii.sum::<f64>() / x.len() as f64).sqrt()
    };
    let (before, after) = (rough(shape.positions()), rough(&off.positions));
    assert!(after < 0.15 * before, "{before} {after}");
}

#[test]
fn masks_mix_the_details_of_two_sources() {
    let target = OnSphere::new(4, 0.1, blob).shape;
    let base = BaseSurface::new(&target, &BaseOptions::default()).unwrap();
    let wave = |k: f64| target.positions().map(|p| 1e-3 * (k * p.z).sin());
    let [a, b] = [9.0, 20.0].map(|k| Detail::with_heights(&base, wave(k)).unwrap());
    let right = target.surface().vertices_where(|p| p.x > 0.0);
    let mask = Mask::inside(&target.surface(), &right, 0.4).unwrap();
    let mixed = a.clone().masked(&mask.inverted()).unwrap();
    let mixed = mixed.plus(&b.clone().masked(&mask).unwrap()).unwrap();
    let apply =
        |detail: &Detail, options: &ApplyOptions| detail.apply(&base, options).unwrap().positions;
    let all = ApplyOptions::default();
    let [of_a, of_b, both] = [&a, &b, &mixed].map(|detail| apply(detail, &all));
    let restricted = apply(&b, &all.clone().mask(mask.clone()));
    for (v, weight) in mask.weights().iter() {
        match *weight {
            0.0 => assert!(both[v] == of_a[v] && restricted[v] == target.positions()[v]),
            1.0 => assert!(both[v] == of_b[v] && restricted[v] == of_b[v]),
            _ => {}
        }
    }
    assert!(mask.weights().values().any(|w| *w == 1.0));
}

#[test]
fn parts_without_counterpart_and_rims_stay_in_place() {
    // The source covers one half of the target only.
    let rippled = |height: f64, cells: usize, width: f64| {
        let flat = bumpy_plane::<f64>([width, 2.0], [cells, cells], 0.0);
        let wave = |p: &Point3<f64>| Point3::new(p.x, p.y, height * (20.0 * p.x).sin());
        flat.with_positions(flat.positions().map(wave)).unwrap()
    };
    let source = rippled(0.01, 40, 2.0);
    let shifted = source.positions().map(|p| p + Vector3::new(1.0, 0.0, 0.0));
    let source = source.with_positions(shifted).unwrap();
    let target = rippled(0.0, 50, 4.0);
    let (from, to) = bases(&source, &target);
    let map = Correspondence::closest(&from, &to, &Similarity::identity());
    let sampled = Detail::of(&from).unwrap().sample(&map, &to).unwrap();
    let stretch = Stretch::measure(&map, &from, &to).unwrap();
    assert!((stretch.coverage - 0.5).abs() < 0.05, "{stretch:?}");
    // Two planes of other sizes: the same map everywhere.
    assert!(
        (stretch.median - 2.0_f64.sqrt()).abs() < 0.02,
        "{stretch:?}"
    );
    assert!(stretch.check(1.5).is_ok() && stretch.check(1.3).is_err());
    let applied = sampled.apply(&to, &ApplyOptions::default()).unwrap();
    let mesh = target.connectivity();
    let mut has_moved = false;
    for (v, p) in target.positions().iter() {
        let same = applied.positions[v] == *p;
        has_moved |= !same;
        if mesh.is_boundary_vertex(v) || p.x < -0.1 {
            assert!(same, "{p}");
        }
    }
    assert!(has_moved);
    let free = ApplyOptions::default().boundary(Boundary::Free);
    let free = sampled.apply(&to, &free).unwrap();
    assert!(farthest(&free.positions, &applied.positions) > 0.0);
}

#[test]
fn the_volume_is_preserved_on_request() {
    let shape = OnSphere::new(3, 0.1, blob).shape;
    let base = BaseSurface::new(&shape, &BaseOptions::default()).unwrap();
    let detail = Detail::with_heights(&base, VertexMap::filled(shape.num_vertices(), 0.01));
    let options = ApplyOptions::default()
        .preserve(Preserve::Volume)
        .scale(0.5);
    let applied = detail.unwrap().apply(&base, &options).unwrap();
    let surface = shape.surface();
    let ratio = surface.with_positions(&applied.positions).volume() / surface.volume();
    assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
    let bounded = ApplyOptions::default().max_displacement(1e-3);
    let bounded = Detail::of(&base)
        .unwrap()
        .scaled(100.0)
        .apply(&base, &bounded)
        .unwrap();
    assert!(farthest(&bounded.positions, shape.positions()) < 1.001e-3);
}

#[test]
fn single_precision_gives_the_same() {
    let shape = OnSphere::new(3, 0.1, bumpy).shape;
    let single = shape.positions().map(|p| p.map(|x| x as f32));
    let single = Mesh::new(shape.connectivity().clone(), single).unwrap();
    let same = single.positions().map(|p| p.map(f64::from));
    let heights = Detail::extract(&single, Wavelength::default()).unwrap();
    let double = Detail::extract(&shape.with_positions(same).unwrap(), Wavelength::default());
    for (a, b) in heights
        .heights()
        .values()
        .zip(double.unwrap().heights().values())
    {
        assert!((a - b).abs() < 1e-9);
    }
    let base = BaseSurface::new(&single, &BaseOptions::default()).unwrap();
    let applied = heights.apply(&base, &ApplyOptions::default()).unwrap();
    assert!(
        applied
            .positions
            .values()
            .all(|p| p.iter().all(|x| x.is_finite()))
    );
}

#[test]
fn inside_out_surfaces_have_the_same_heights() {
    let shape = OnSphere::new(3, 0.1, bumpy).shape;
    let mut reversed = shape.to_triangles();
    reversed.chunks_mut(3).for_each(|t| t.swap(0, 1));
    let reversed = Mesh::from_triangles(&shape.to_positions::<f64>(), &reversed).unwrap();
    let [a, b] = [&shape, &reversed].map(|s| Detail::extract(s, Wavelength::default()).unwrap());
    for (a, b) in a.heights().values().zip(b.heights().values()) {
        assert!((a - b).abs() < 1e-10);
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let (shape, other) = (torus::<f64>(1.0, 0.4, 20, 10), icosphere::<f64>(2));
    for wavelength in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for wavelength in [
            Wavelength::Share(wavelength),
            Wavelength::Length(wavelength),
        ] {
            assert!(Detail::extract(&shape, wavelength).is_err());
        }
    }
    let (from, to) = bases(&shape, &other);
    let detail = Detail::of(&from).unwrap();
    let point = |weights| {
        Some(CorrespondingPoint {
            corners: [0, 1, 2].map(VertexId::new),
            weights,
        })
    };
    for weights in [[0.5, 0.6, 0.5], [-0.5, 1.0, 0.5], [f64::NAN, 0.5, 0.5]] {
        let points = VertexMap::filled(other.num_vertices(), point(weights));
        let refused = Correspondence::new(shape.num_vertices(), points);
        assert!(matches!(refused, Err(DetailError::NotAPoint { .. })));
    }
    let points = VertexMap::filled(other.num_vertices(), point([0.5, 0.25, 0.25]));
    assert!(Correspondence::new(2, points.clone()).is_err());
    let map = Correspondence::new(shape.num_vertices() + 1, points).unwrap();
    assert!(matches!(
        detail_error(&detail, &map, &to),
        DetailError::OtherMeshes { .. }
    ));
    assert!(detail.apply(&to, &ApplyOptions::default()).is_err());
    let own = Detail::of(&to).unwrap();
    assert!(
        own.apply(&to, &ApplyOptions::default().scale(f64::NAN))
            .is_err()
    );
    assert!(
        own.apply(&to, &ApplyOptions::default().max_displacement(-1.0))
            .is_err()
    );
    let mask = Mask::new(VertexMap::filled(3, 1.0)).unwrap();
    assert!(own.apply(&to, &ApplyOptions::default().mask(mask)).is_err());
}

/// The details of a shape on the other, by directions from the origin.
fn transferred(source: &Mesh<f64>, target: &Mesh<f64>, map: &Correspondence) -> Positions<f64> {
    let (from, to) = bases(source, target);
    let sampled = Detail::of(&from).unwrap().sample(map, &to).unwrap();
    sampled
        .apply(&to, &ApplyOptions::default().scale(0.5))
        .unwrap()
        .positions
}

fn directions(shape: &Mesh<f64>) -> Option<SphereMap<f64>> {
    let ball = shape
        .positions()
        .map(|p| Point3::from(p.coords.normalize()));
    SphereMap::new(shape.connectivity(), ball).ok()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn motions_scales_and_numbers_commute(
        a in blobs(), b in blobs(), motions in [rigid_motions(), rigid_motions()],
        scales in [0.1..10.0, 0.1..10.0],
    ) {
        let (Some(of_a), Some(of_b)) = (directions(&a), directions(&b)) else {
            return Ok(());
        };
        let map = Correspondence::on_sphere(&of_a, &of_b).unwrap();
        let moved = |shape: &Mesh<f64>, k: usize| {
            let positions = shape.positions().map(|p| motions[k] * (p * scales[k]));
            shape.with_positions(positions).unwrap()
        };
        let before = transferred(&a, &b, &map);
        let after = transferred(&moved(&a, 0), &moved(&b, 1), &map);
        let expected = before.map(|p| motions[1] * (p * scales[1]));
        let off = farthest(&after, &expected);
        prop_assert!(off < 1e-6 * scales[1], "{off:e}");

        // The source's vertices in reverse.
        let last = a.num_vertices() as u32 - 1;
        let triangles: Vec<u32> = a.to_triangles().iter().map(|v| last - v).collect();
        let mut points = a.to_positions::<f64>();
        points.reverse();
        let reversed = Mesh::from_triangles(&points, &triangles).unwrap();
        let points = map.points().map(|point| point.map(|point| CorrespondingPoint {
            corners: point.corners.map(|v| VertexId::new((last - v.index() as u32) as usize)),
            ..point
        }));
        let other = Correspondence::new(a.num_vertices(), points).unwrap();
        let off = farthest(&transferred(&reversed, &b, &other), &before);
        prop_assert!(off < 1e-6, "{off:e}");
    }
}
