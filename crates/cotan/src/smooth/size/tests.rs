use std::ops::ControlFlow;

use cotan_geometry::shapes::{bumpy_plane, icosphere, torus};
use cotan_geometry::testing::{blobs, rigid_motions, surfaces};
use cotan_geometry::{Mesh, Surface};
use cotan_halfedge::VertexMap;
use cotan_linear::{Method, Strategy};
use nalgebra::Point3;
use proptest::prelude::*;

use super::*;
use crate::smooth::{Preserve, with_normal_noise};

fn smoothed(shape: &Mesh<f64>, share: f64) -> Positions<f64> {
    by(shape, &BumpSize::Share(share), BySizeOptions::default())
}

fn by(shape: &Mesh<f64>, size: &BumpSize, options: BySizeOptions) -> Positions<f64> {
    smooth_by_size(shape, &Handles::new(), size, &options)
        .unwrap()
        .positions
}

fn farthest(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
    let pairs = a.values().zip(b.values());
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

fn rms(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
    let pairs = a.values().zip(b.values());
    let sum: f64 = pairs.map(|(a, b)| (a - b).norm_squared()).sum();
    (sum / a.len() as f64).sqrt()
}

fn rough() -> Mesh<f64> {
    let shape = torus::<f64>(1.0, 0.4, 40, 20);
    let noisy = with_normal_noise(&shape.surface(), 0.01, 9);
    shape.with_positions(noisy).unwrap()
}

/// Two bodies, one a tenth of the other in size.
fn two_spheres() -> Mesh<f64> {
    let (large, small) = (icosphere::<f64>(3), icosphere::<f64>(2));
    let mut points = large.to_positions::<f64>();
    let first = points.len() as u32;
    points.extend(
        small
            .to_positions::<f64>()
            .iter()
            .map(|p| p.map(|x| 0.1 * x)),
    );
    for p in &mut points[first as usize..] {
        p[0] += 2.0;
    }
    let mut triangles = large.to_triangles();
    triangles.extend(small.to_triangles().iter().map(|v| v + first));
    Mesh::from_triangles(&points, &triangles).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn rigid_motions_and_scales_commute(
        shape in blobs(), motion in rigid_motions(), scale in 0.1..10.0, share in 0.01..0.3,
    ) {
        let moved = |p: &Point3<f64>| motion * (p * scale);
        let other = shape.with_positions(shape.positions().map(moved)).unwrap();
        // A share would be one of another box.
        let length = share * shape.surface().bounding_box().longest_side();
        let options = BySizeOptions::default();
        let after = by(&shape, &BumpSize::Length(length), options).map(moved);
        let before = by(&other, &BumpSize::Length(length * scale), options);
        prop_assert!(farthest(&after, &before) < 1e-6 * scale);
    }

    #[test]
    fn planes_stay_planes(motion in rigid_motions(), share in 0.01..0.3, seed in 0u64..100) {
        let flat = bumpy_plane::<f64>([2.0, 1.0], [16, 8], 0.0);
        // Inner vertices are scattered in the plane.
        let noise: Vec<f64> = crate::smooth::GaussianNoise::new(seed).take(2 * 17 * 9).collect();
        let mesh = flat.connectivity();
        let x: Positions<f64> = flat
            .positions()
            .iter()
            .map(|(v, p)| {
                let is_rim = mesh.is_boundary_vertex(v);
                let k = v.index();
                let way = if is_rim { 0.0 } else { 0.01 };
                motion * (p + Vector3::new(noise[2 * k], noise[2 * k + 1], 0.0) * way)
            })
            .collect();
        let shape = flat.with_positions(x).unwrap();
        let after = smoothed(&shape, share);
        let back = motion.inverse();
        prop_assert!(after.values().all(|p| (back * p).z.abs() < 1e-10));
    }

    #[test]
    fn renumbering_commutes(shape in blobs(), share in 0.02..0.2) {
        let n = shape.num_vertices();
        let order: Vec<usize> = (0..n).rev().collect();
        let mut points = vec![[0.0; 3]; n];
        for (v, p) in shape.positions().iter() {
            points[order[v.index()]] = [p.x, p.y, p.z];
        }
        let renumbered: Vec<u32> =
            shape.to_triangles().iter().map(|v| order[*v as usize] as u32).collect();
        let other = Mesh::from_triangles(&points, &renumbered).unwrap();
        let (after, theirs) = (smoothed(&shape, share), smoothed(&other, share));
        for (v, p) in after.iter() {
            let same = theirs[VertexId::new(order[v.index()])];
            prop_assert!((p - same).norm() < 1e-7);
        }
    }

    #[test]
    fn any_surface_is_smoothed_at_any_size(shape in surfaces(), share in 0.0..3.0) {
        let options = BySizeOptions::default();
        let done = smooth_by_size(&shape, &Handles::new(), &BumpSize::Share(share), &options);
        prop_assert!(done.unwrap().positions.values().all(|p| p.iter().all(|x| x.is_finite())));
    }
}

#[test]
fn spheres_stay_spheres_of_their_radius() {
    let shape = icosphere::<f64>(4);
    for share in [0.02, 0.1, 0.5, 2.0] {
        let x = smoothed(&shape, share);
        let off = x.values().map(|p| (p.coords.norm() - 1.0).abs());
        let off = off.fold(0.0, f64::max);
        assert!(off < 2e-3, "{share}: {off:e}");
    }
}

#[test]
fn a_size_of_nothing_is_the_identity_and_the_motion_grows_with_the_size() {
    let shape = rough();
    assert_eq!(&smoothed(&shape, 0.0), shape.positions());
    let mut last = 0.0;
    for share in [1e-5, 1e-3, 0.01, 0.02, 0.05, 0.1, 0.2] {
        let motion = rms(&smoothed(&shape, share), shape.positions());
        assert!(motion >= last, "{share}: {motion} after {last}");
        last = motion;
    }
    let least = farthest(&smoothed(&shape, 1e-4), shape.positions());
    assert!(least < 1e-6, "{least:e}");
}

#[test]
fn a_flat_part_keeps_its_digits() {
    let shape = bumpy_plane::<f64>([2.0, 1.0], [20, 10], 0.0);
    assert_eq!(&smoothed(&shape, 0.1), shape.positions());
}

#[test]
fn the_iteration_agrees_with_the_factorization() {
    let shape = rough();
    let run = |strategy| {
        let options = BySizeOptions::default().strategy(strategy);
        let mut job = SmoothBySize::new(&shape, &Handles::new(), &options).unwrap();
        let first = job.smooth(&BumpSize::Share(0.3)).unwrap();
        let second = job.smooth(&BumpSize::Share(0.05)).unwrap();
        assert_ne!(first.positions, second.positions);
        second
    };
    let (direct, iterative) = (run(Strategy::Normal), run(Strategy::Iterative));
    assert_eq!(direct.strategy.unwrap().method, Method::Normal);
    assert_eq!(iterative.strategy.unwrap().method, Method::Iterative);
    assert!(farthest(&direct.positions, &iterative.positions) < 1e-6);
}

#[test]
fn a_session_gives_what_a_single_call_gives() {
    let shape = rough();
    let options = BySizeOptions::default();
    let mut job = SmoothBySize::new(&shape, &Handles::new(), &options).unwrap();
    for share in [0.02, 0.1, 0.02] {
        let live = job.smooth(&BumpSize::Share(share)).unwrap().positions;
        assert_eq!(live, smoothed(&shape, share));
    }
}

#[test]
fn every_component_keeps_its_size() {
    let shape = two_spheres();
    let x = smoothed(&shape, 0.1);
    let radius = |v: &VertexId, p: &Point3<f64>| match v.index() < 642 {
        true => p.coords.norm(),
        false => 10.0 * (p - Point3::new(2.0, 0.0, 0.0)).norm(),
    };
    for (v, p) in x.iter() {
        assert!(
            (radius(&v, p) - 1.0).abs() < 0.02,
            "{v:?}: {}",
            radius(&v, p)
        );
    }
}

#[test]
fn volume_is_kept_exactly_on_request() {
    let shape = rough();
    let options = BySizeOptions::default().preserve(Preserve::Volume);
    let x = by(&shape, &BumpSize::Share(0.1), options);
    let [before, after] =
        [shape.positions(), &x].map(|x| shape.surface().with_positions(x).volume());
    assert!((after / before - 1.0).abs() < 1e-9);
}

#[test]
fn rims_are_fixed_or_smoothed_like_the_surface() {
    let wavy = bumpy_plane::<f64>([2.0, 2.0], [40, 40], 0.0);
    let mesh = wavy.connectivity();
    // A zigzag of the size of an edge along the rim.
    let zigzag = wavy.positions().iter().map(|(v, p)| {
        let sign = if v.index() % 2 == 0 { 1.0 } else { -1.0 };
        let is_rim = mesh.is_boundary_vertex(v);
        p + Vector3::z() * if is_rim { 0.02 * sign } else { 0.0 }
    });
    let shape = wavy.with_positions(zigzag.collect()).unwrap();
    let height = |x: &Positions<f64>| -> f64 {
        let rim = mesh.vertices().filter(|v| mesh.is_boundary_vertex(*v));
        rim.map(|v| x[v].z.abs()).fold(0.0, f64::max)
    };
    let fixed = smoothed(&shape, 0.1);
    assert_eq!(height(&fixed), 0.02);
    let options = BySizeOptions::default().boundary(Boundary::Free);
    let free = by(&shape, &BumpSize::Share(0.1), options);
    assert!(height(&free) < 0.003, "{}", height(&free));
    // A hole that is small against the size stays.
    let large = by(&shape, &BumpSize::Share(0.8), options);
    assert!((height(&large) - 0.02).abs() < 1e-12);
}

#[test]
fn handles_are_met_exactly() {
    let shape = icosphere::<f64>(3);
    let top = VertexId::new(0);
    let goal = shape.positions()[top] * 1.2;
    let handles = Handles::new().move_to(top, goal);
    let done = smooth_by_size(
        &shape,
        &handles,
        &BumpSize::Share(0.2),
        &BySizeOptions::default(),
    )
    .unwrap();
    assert!((done.positions[top] - goal).norm() < 1e-14);
}

#[test]
fn a_field_of_one_size_is_that_size_and_a_size_of_zero_holds() {
    let shape = rough();
    let n = shape.num_vertices();
    let options = BySizeOptions::default();
    let length = BumpSize::Length(0.2);
    let field = BumpSize::PerVertex(VertexMap::filled(n, 0.2));
    assert_eq!(by(&shape, &length, options), by(&shape, &field, options));
    // A size that grows along x: the left stays, the right is smoothed as by its own size.
    let sizes = shape
        .positions()
        .map(|p| (0.15 * (p.x + 0.5)).clamp(0.0, 0.15));
    let x = by(&shape, &BumpSize::PerVertex(sizes.clone()), options);
    let right = by(&shape, &BumpSize::Length(0.15), options);
    for (v, p) in x.iter() {
        let original = shape.positions()[v];
        if sizes[v] == 0.0 {
            assert!((p - original).norm() < 1e-6, "{:e}", (p - original).norm());
        }
        if original.x > 1.1 {
            assert!((p - right[v]).norm() < 2e-3, "{:e}", (p - right[v]).norm());
        }
    }
    let short = BumpSize::PerVertex(VertexMap::filled(3, 0.1));
    assert!(smooth_by_size(&shape, &Handles::new(), &short, &options).is_err());
}

#[test]
fn nothing_moves_outside_of_a_mask() {
    let shape = rough();
    let surface = shape.surface();
    let right = surface.vertices_where(|p| p.x > 0.0);
    let mask = Mask::inside(&surface, &right, 0.5).unwrap();
    let options = BySizeOptions::default().preserve(Preserve::Volume);
    let mut job = SmoothBySize::new(&shape, &Handles::new(), &options).unwrap();
    job.set_mask(mask.clone()).unwrap();
    let part = job.smooth(&BumpSize::Share(0.1)).unwrap().positions;
    for (v, p) in part.iter() {
        assert!(mask.weights()[v] > 0.0 || *p == shape.positions()[v]);
    }
    assert!(rms(&part, shape.positions()) > 1e-3);
    let [before, after] = [shape.positions(), &part].map(|x| surface.with_positions(x).volume());
    assert!((after / before - 1.0).abs() < 1e-9);
    let other = Mask::new(VertexMap::filled(3, 1.0)).unwrap();
    assert!(job.set_mask(other).is_err());
}

#[test]
fn single_precision_does_the_same_within_its_digits() {
    let shape = rough();
    let single = shape.cast::<f32>();
    let options = BySizeOptions::default();
    let size = BumpSize::Share(0.05);
    let x = smooth_by_size(&single, &Handles::new(), &size, &options)
        .unwrap()
        .positions;
    let x = x.map(|p| p.cast::<f64>());
    assert!(farthest(&x, &smoothed(&shape, 0.05)) < 1e-5);
}

#[test]
fn an_observer_sees_each_solve_and_may_stop() {
    let shape = rough();
    let options = BySizeOptions::default();
    let mut job = SmoothBySize::new(&shape, &Handles::new(), &options).unwrap();
    let size = BumpSize::Share(0.05);
    let stop = |solve| match solve < 3 {
        true => ControlFlow::Continue(()),
        false => ControlFlow::Break(()),
    };
    let stopped = job.smooth_observed(&size, &stop);
    assert_eq!(stopped.unwrap_err(), Error::Cancelled);
    assert_eq!(job.smooth(&size).unwrap().positions, smoothed(&shape, 0.05));
}

#[test]
fn refusals_name_the_setting() {
    let shape = icosphere::<f64>(2);
    let none = Handles::new();
    for size in [-1.0, f64::NAN, f64::INFINITY] {
        let options = BySizeOptions::default();
        let refused = smooth_by_size(&shape, &none, &BumpSize::Share(size), &options);
        assert!(refused.unwrap_err().to_string().contains("size"));
    }
    let options = BySizeOptions::default().max_displacement(-1.0);
    assert!(SmoothBySize::new(&shape, &none, &options).is_err());
    let options = BySizeOptions::default().max_memory(1_000);
    let refused = smooth_by_size(&shape, &none, &BumpSize::DEFAULT, &options);
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("raise the limit"), "{message}");
}

#[test]
fn slivers_and_points_without_area_are_harmless() {
    // A bar with a triangle of no area, as CAD programs write them.
    let bar = cotan_geometry::shapes::bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
    let mut x = bar.positions().clone();
    let f = cotan_halfedge::FaceId::new(40);
    let [a, b, c] = bar.connectivity().triangle(f);
    x[c] = Point3::from((x[a].coords + x[b].coords) * 0.5);
    let shape = bar.with_positions(x).unwrap();
    for share in [0.01, 0.05, 0.2] {
        let after = smoothed(&shape, share);
        assert!(farthest(&after, shape.positions()) < 0.3, "{share}");
    }
    let surface = Surface::assume_checked(shape.connectivity(), shape.positions());
    assert!(surface.area() > 0.0);
}

/// A sphere with sectoral waves of this degree, and the share of them that is left.
fn kept(degree: i32, share: f64) -> f64 {
    let sphere = icosphere::<f64>(5);
    let wave = |p: &Point3<f64>| nalgebra::Complex::new(p.x, p.y).powi(degree).re;
    let height = 0.05 / f64::from(degree * degree);
    let x = sphere.positions().map(|p| p * (1.0 + height * wave(p)));
    let bumpy = sphere.with_positions(x).unwrap();
    let areas = sphere.surface().dual_areas();
    let part = |x: &Positions<f64>| -> f64 {
        let pairs = x.iter().zip(sphere.positions().values());
        pairs
            .map(|((v, p), q)| p.coords.norm() * areas[v] * wave(q))
            .sum()
    };
    let none = part(sphere.positions());
    (part(&smoothed(&bumpy, share)) - none) / (part(bumpy.positions()) - none)
}

/// 1 − B², within 0.03 above 0.7 and within 0.07 at one half.
#[test]
fn waves_are_kept_according_to_their_width() {
    for degree in [6, 12] {
        let eigenvalue = f64::from(4 * degree * (degree + 1));
        for (ratio, tolerance) in [(2.0, 0.03), (1.3, 0.03), (1.0, 0.07)] {
            // λ = (π / width)².
            let share = PI / eigenvalue.sqrt() / ratio;
            let b = 1.0 / (1.0 + (screen(share) / eigenvalue).powi(2));
            let (found, theory) = (kept(degree, share), 1.0 - b * b);
            assert!(
                (found - theory).abs() < tolerance,
                "degree {degree}, {ratio}: {found} instead of {theory}"
            );
        }
    }
}

/// The curvature that a masked job adds has no step at the border: 5 % of the range of the
/// curvature at most between neighbours there.
#[test]
fn the_border_of_a_mask_has_no_step() {
    let sphere = icosphere::<f64>(5);
    let wave = |p: &Point3<f64>| (9.0 * p.x).sin() * (9.0 * p.y).sin() * (9.0 * p.z).cos();
    let x = sphere.positions().map(|p| p * (1.0 + 0.02 * wave(p)));
    let shape = sphere.with_positions(x).unwrap();
    let surface = shape.surface();
    let upper = surface.vertices_where(|p| p.z > 0.0);
    let mask = Mask::inside(&surface, &upper, 0.6).unwrap();
    let options = BySizeOptions::default();
    let mut job = SmoothBySize::new(&shape, &Handles::new(), &options).unwrap();
    job.set_mask(mask.clone()).unwrap();
    let part = job.smooth(&BumpSize::Share(0.3)).unwrap().positions;
    let before = crate::smooth::curvature_field(&surface);
    let after = crate::smooth::curvature_field(&surface.with_positions(&part));
    let range = before.values().copied().fold(f64::MIN, f64::max)
        - before.values().copied().fold(f64::MAX, f64::min);
    let mut edges = 0;
    for e in shape.connectivity().edges() {
        let [a, b] = shape.connectivity().edge_vertices(e);
        if (mask.weights()[a] == 0.0) != (mask.weights()[b] == 0.0) {
            let step = (after[a] - before[a]) - (after[b] - before[b]);
            assert!(step.abs() < 0.05 * range, "{step} of {range}");
            edges += 1;
        }
    }
    assert!(edges > 50, "{edges}");
}
