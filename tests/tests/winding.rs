//! Turns of more than half a turn.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use cotan::prelude::*;
use cotan::shapes::bar;
use cotan_tests::Draw;
use nalgebra::{Rotation3, Vector3};

/// A bar or rod with bumps of 2 % of its width on its surface.
fn bumpy(shape: &Mesh<f64>, width: f64) -> Mesh<f64> {
    let mut draw = Draw::new(3);
    let bumps = shape.positions().map(|p| {
        let inner = p.x.abs() < 0.98 * shape.positions()[VertexId::new(0)].x.abs();
        let bump = draw.vector() * (0.02 * width);
        if inner { p + bump } else { *p }
    });
    Mesh::new(shape.connectivity().clone(), bumps).unwrap()
}

/// A rod: a bar with a rounded cross section.
fn rod(length: f64, radius: f64) -> Mesh<f64> {
    let square = bar::<f64>([length, 2.0 * radius, 2.0 * radius], [48, 10, 10]);
    let round = square.positions().map(|p| {
        let largest = p.y.abs().max(p.z.abs());
        let norm = p.y.hypot(p.z).max(1e-12);
        Point3::new(p.x, p.y * largest / norm, p.z * largest / norm)
    });
    Mesh::new(square.connectivity().clone(), round).unwrap()
}

/// The angle in degrees by which the cross sections of a bar along x turn from end to end, summed
/// from section to section.
fn winding(shape: &Mesh<f64>, moved: &Positions<f64>) -> f64 {
    let original = shape.positions();
    let mut places: Vec<f64> = original
        .values()
        .map(|p| (p.x * 1e4).round() / 1e4)
        .collect();
    places.sort_by(f64::total_cmp);
    places.dedup_by(|a, b| (*a - *b).abs() < 0.05);
    let mut total = 0.0;
    let mut last: Option<f64> = None;
    for place in places {
        // The direction of the section's vertices, as complex numbers about its own centre.
        let section: Vec<_> = original
            .iter()
            .filter(|(_, p)| (p.x - place).abs() < 0.05)
            .map(|(v, p)| [*p, moved[v]])
            .collect();
        let n = section.len() as f64;
        let mean = |k: usize| section.iter().map(|s| s[k].coords).sum::<Vector3<f64>>() / n;
        let (before, after) = (mean(0), mean(1));
        let (mut re, mut im) = (0.0, 0.0);
        for [a, b] in &section {
            let (a, b) = (a.coords - before, b.coords - after);
            re += a.y * b.y + a.z * b.z;
            im += a.y * b.z - a.z * b.y;
        }
        let angle = im.atan2(re).to_degrees();
        if let Some(last) = last {
            total += (angle - last + 540.0).rem_euclid(360.0) - 180.0;
        }
        last = Some(angle);
    }
    total
}

fn wound(shape: &Mesh<f64>, degrees: f64) -> Deformed<f64> {
    let end = shape.positions().values().map(|p| p.x).fold(0.0, f64::max);
    let surface = shape.surface();
    let left = surface.vertices_where(|p| p.x < -end + 1e-9);
    let right = surface.vertices_where(|p| p.x > end - 1e-9);
    let turn = Vector3::x() * degrees.to_radians();
    let handles = Handles::new()
        .fix(left)
        .transform(right, Rotation3::new(turn).to_homogeneous())
        .turned(turn);
    deform(shape, &handles, &DeformOptions::default()).unwrap()
}

/// Specified turns of more than half a turn are kept in spite of bumps: 330° on a bar of 6 : 1,
/// 360° on a rod of 4 : 1.
#[test]
fn turns_of_more_than_half_a_turn_are_held() {
    let cases = [
        (
            bumpy(&bar::<f64>([6.0, 1.0, 1.0], [48, 8, 8]), 1.0),
            [270.0, 330.0],
        ),
        (bumpy(&rod(4.0, 0.5), 1.0), [270.0, 360.0]),
    ];
    for (shape, angles) in &cases {
        for &angle in angles {
            let moved = wound(shape, angle);
            assert_eq!(moved.report.stop, StopReason::Converged, "{angle}");
            let held = winding(shape, &moved.positions);
            assert!((held - angle).abs() < 5.0, "{angle}: {held}");
            assert_eq!(moved.report.lost_turn, None, "{angle}");
        }
    }
}

/// A rod along x whose radius is multiplied by a function of x.
fn turned_rod(length: f64, factor: impl Fn(f64) -> f64) -> Mesh<f64> {
    let round = rod(length, 0.5);
    let narrowed = round.positions().map(|p| {
        let factor = factor(p.x);
        Point3::new(p.x, p.y * factor, p.z * factor)
    });
    Mesh::new(round.connectivity().clone(), narrowed).unwrap()
}

/// A turn that is too wide is lost, and the report estimates the angle that the shape holds.
#[test]
fn a_lost_turn_is_reported_with_the_angle_that_the_shape_holds() {
    // Each with an angle that it holds, the next wider one by 30°, which it loses, and the error
    // of the estimate that is allowed.
    let cases = [
        (bar::<f64>([3.0, 1.0, 1.0], [24, 8, 8]), 1.0, 330.0, 0.15),
        (bar::<f64>([6.0, 1.0, 1.0], [48, 8, 8]), 1.0, 510.0, 0.15),
        (rod(4.0, 0.5), 1.0, 450.0, 0.15),
        (turned_rod(4.0, |x| 1.0 + 0.2 * x), 1.0, 420.0, 0.15),
        (
            turned_rod(4.0, |x| if x.abs() < 0.5 { 0.5 } else { 1.0 }),
            0.5,
            330.0,
            0.25,
        ),
    ];
    for (shape, width, holds, error) in cases {
        let shape = bumpy(&shape, width);
        let moved = wound(&shape, holds);
        assert_eq!(moved.report.lost_turn, None, "{holds}");
        let moved = wound(&shape, holds + 30.0);
        let turned = winding(&shape, &moved.positions);
        assert!((turned - holds - 30.0).abs() > 90.0, "{holds}: {turned}");
        let lost = moved.report.lost_turn.unwrap();
        assert!(lost.back.to_degrees() > 130.0, "{holds}: {lost:?}");
        let estimate = lost.held.to_degrees();
        println!("holds {holds}, estimated {estimate:.0}");
        let middle = holds + 15.0;
        assert!(
            (estimate / middle - 1.0).abs() < error,
            "{holds}: {estimate}"
        );
    }
}

/// A handle of a session that is turned by steps of 30° comes out as a turn that is stated at once,
/// and turned back, as one that is not wound.
#[test]
fn a_session_keeps_the_winding_of_a_handle() {
    let shape = bumpy(&bar::<f64>([6.0, 1.0, 1.0], [48, 8, 8]), 1.0);
    let surface = shape.surface();
    let left = surface.vertices_where(|p| p.x < -2.999);
    let right = surface.vertices_where(|p| p.x > 2.999);
    let motion = |degrees: f64| Rotation3::new(Vector3::x() * degrees.to_radians());
    let handles = Handles::new()
        .fix(left.clone())
        .transform(right.clone(), motion(0.0).to_homogeneous());
    let options = DeformOptions::default().tolerance(1e-6);
    let at_once = |degrees: f64| {
        let handles = Handles::new()
            .fix(left.clone())
            .transform(right.clone(), motion(degrees).to_homogeneous())
            .turned(Vector3::x() * degrees.to_radians());
        deform(&shape, &handles, &options).unwrap().positions
    };
    let farthest = |a: &Positions<f64>, b: &Positions<f64>| {
        let pairs = a.values().zip(b.values());
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    let mut session = Session::new(&shape, &handles, &options).unwrap();
    let steps = (1..=12).chain((3..12).rev()).map(|k| 30.0 * f64::from(k));
    for (frame, degrees) in steps.enumerate() {
        let matrix = motion(degrees).to_homogeneous();
        session.transform_handle(1, matrix).unwrap();
        // Some frames have time for one step only.
        if frame % 3 == 1 {
            session.step().unwrap();
            continue;
        }
        let report = session.run().unwrap();
        assert_eq!(report.stop, StopReason::Converged, "{degrees}");
        assert_eq!(report.lost_turn, None, "{degrees}");
        let held = winding(&shape, &session.positions());
        assert!((held - degrees).abs() < 5.0, "{degrees}: {held}");
        if [330.0, 360.0, 270.0, 90.0].contains(&degrees) {
            let gap = farthest(&session.positions(), &at_once(degrees));
            assert!(gap < 0.006, "{degrees}: {gap}");
        }
    }
}

/// A turn that is stated in a session at once winds the shape up anew.
#[test]
fn a_session_takes_a_stated_turn() {
    let shape = bumpy(&bar::<f64>([6.0, 1.0, 1.0], [48, 8, 8]), 1.0);
    let surface = shape.surface();
    let left = surface.vertices_where(|p| p.x < -2.999);
    let right = surface.vertices_where(|p| p.x > 2.999);
    let turn = Vector3::x() * f64::to_radians(330.0);
    let start = Handles::new().fix(left).fix(right.clone());
    let mut session = Session::new(&shape, &start, &DeformOptions::default()).unwrap();
    let mut handles = session.handles().clone();
    let matrix = Rotation3::new(turn).to_homogeneous();
    handles.set_motion(HandleId::new(1), Motion::Transform(matrix));
    handles.set_turn(HandleId::new(1), Some(turn));
    session.set_handles(&handles).unwrap();
    let report = session.run().unwrap();
    assert_eq!(report.stop, StopReason::Converged);
    let held = winding(&shape, &session.positions());
    assert!((held - 330.0).abs() < 5.0, "{held}");
}

/// Enforcing the winding keeps turns that the energy alone does not.
#[test]
fn a_winding_is_held_by_request() {
    let shape = bumpy(&bar::<f64>([6.0, 1.0, 1.0], [48, 8, 8]), 1.0);
    let turn = Vector3::x() * f64::to_radians(540.0);
    let surface = shape.surface();
    let handles = Handles::new()
        .fix(surface.vertices_where(|p| p.x < -2.999))
        .transform(
            surface.vertices_where(|p| p.x > 2.999),
            Rotation3::new(turn).to_homogeneous(),
        )
        .turned(turn);
    let options = DeformOptions::default().hold_winding(0.3);
    let moved = deform(&shape, &handles, &options).unwrap();
    assert_eq!(moved.report.lost_turn, None);
    let held = winding(&shape, &moved.positions);
    assert!((held - 540.0).abs() < 5.0, "{held}");
}

/// A bar that is bent to a ring of 300° closes cleanly.
#[test]
fn a_bar_bends_to_a_ring() {
    let length = 9.0;
    let shape = bar::<f64>([length, 1.0, 1.0], [72, 8, 8]);
    let surface = shape.surface();
    let left = surface.vertices_where(|p| p.x < -0.5 * length + 1e-9);
    let right = surface.vertices_where(|p| p.x > 0.5 * length - 1e-9);
    let angle = f64::to_radians(300.0);
    let radius = length / angle;
    // The end of an arc that starts at the left end along x.
    let turn = Vector3::z() * angle;
    let end = Vector3::new(radius * angle.sin(), radius * (1.0 - angle.cos()), 0.0);
    let start = Vector3::new(-0.5 * length, 0.0, 0.0);
    let motion = nalgebra::Translation3::from(start + end).to_homogeneous()
        * Rotation3::new(turn).to_homogeneous()
        * nalgebra::Translation3::new(-0.5 * length, 0.0, 0.0).to_homogeneous();
    let handles = Handles::new()
        .fix(left)
        .transform(right, motion)
        .turned(turn);
    let moved = deform(&shape, &handles, &DeformOptions::default()).unwrap();
    assert_eq!(moved.report.stop, StopReason::Converged);
    assert_eq!(moved.report.lost_turn, None);
    let quality = Quality::measure(&surface, &surface.with_positions(&moved.positions)).unwrap();
    assert_eq!(quality.flipped_faces + quality.folded_edges, 0);
    let volume = quality.volume_ratio.unwrap();
    assert!((volume - 1.0).abs() < 0.1, "{volume}");
    // The middle of the bar is opposite the gap of the ring.
    let middle = surface.vertices_where(|p| p.x.abs() < 0.07);
    let mean = middle
        .iter()
        .map(|&v| moved.positions[v].coords)
        .sum::<Vector3<f64>>()
        / middle.len() as f64;
    let half = 0.5 * angle;
    let arc = start + Vector3::new(radius * half.sin(), radius * (1.0 - half.cos()), 0.0);
    assert!((mean - arc).norm() < 0.4 * radius, "{mean} {arc}");
}
