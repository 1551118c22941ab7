//! The ogre: a body with eyes, teeth, nails and horns.

use std::time::Instant;

use cotan::prelude::*;
use cotan_io::{Numbering, Repair, Weld};
use cotan_tests::shared;
use nalgebra::Vector3;

use crate::models::{alone, farthest, of_part, turn, worst};

fn ogre() -> Option<Mesh<f64>> {
    let document = cotan_io::load(&shared("meshes/ogre.obj")?).unwrap();
    let repaired = Repair::default().apply(&document).unwrap();
    let surface = repaired
        .document
        .surface_numbered(Weld::AsFormat, Numbering::Document)
        .unwrap();
    Some(Mesh::new(surface.mesh().clone(), surface.positions().clone()).unwrap())
}

/// Name, what is held still, what turns, and how: by a part of the whole way.
type Edit = (
    &'static str,
    fn(&Point3<f64>) -> bool,
    fn(&Point3<f64>) -> bool,
    fn(f64) -> Matrix4<f64>,
);

fn edits() -> [Edit; 3] {
    [
        (
            "head",
            |p| p.y < 19.0,
            |p| p.y > 27.5 && p.x.abs() < 3.0,
            |part| turn([0.0, 25.5, 0.0], Vector3::z(), 35.0 * part),
        ),
        (
            "hip",
            |p| p.y < 2.0,
            |p| p.y > 19.0,
            |part| turn([0.0, 15.0, 0.0], Vector3::x(), 30.0 * part),
        ),
        (
            "hand",
            |p| p.x < 8.0,
            |p| p.x > 13.5,
            |part| turn([13.0, 24.0, 0.0], Vector3::z(), 35.0 * part),
        ),
    ]
}

/// All parts keep their places on the body, and the body is what it is alone.
#[test]
fn the_parts_of_the_ogre_follow_its_body() {
    let Some(shape) = ogre() else { return };
    let components = shape.connectivity().components();
    let body = (0..components.count())
        .max_by_key(|c| components.sizes()[*c])
        .unwrap();
    let (own, vertices) = alone(&shape, body);
    for (name, still, moved, motion) in edits() {
        let handles = |shape: &Mesh<f64>, part| {
            let (still, moved) = (of_part(shape, part, still), of_part(shape, part, moved));
            assert!(!still.is_empty() && !moved.is_empty());
            Handles::new().fix(still).transform(moved, motion(1.0))
        };
        let options = DeformOptions::default();
        let clock = Instant::now();
        let single = deform(&own, &handles(&own, 0), &options).unwrap();
        let of_single = clock.elapsed();
        let clock = Instant::now();
        let whole = deform(&shape, &handles(&shape, body), &options).unwrap();
        let of_whole = clock.elapsed();
        let body: Positions<f64> = vertices.iter().map(|v| whole.positions[*v]).collect();
        assert_eq!(farthest(&body, &single.positions), 0.0);
        let [gap, turn] = worst(&whole.parts);
        println!(
            "{name}: gap {:.4} %, turn {turn:.2}°, {} iterations, {of_whole:.2?} against {of_single:.2?}",
            gap * 100.0,
            whole.report.iterations
        );
        for (k, part) in whole.parts.iter().enumerate() {
            if part.gap_change > 1e-3 || part.turn_degrees > 1.0 {
                println!("  {k}: {part:?}");
            }
        }
        assert!(gap < 0.004 && turn < 2.0, "{name}: {gap} {turn}");
    }
}

/// A measurement: passengers add at most 30 % to a frame of a drag.
#[test]
#[ignore = "a measurement; run it in a release build"]
fn passengers_cost_little_of_a_frame() {
    let Some(shape) = ogre() else { return };
    let components = shape.connectivity().components();
    let body = (0..components.count())
        .max_by_key(|c| components.sizes()[*c])
        .unwrap();
    let (own, _) = alone(&shape, body);
    let mut most = 0.0_f64;
    for (name, still, moved, motion) in edits() {
        let session = |shape: &Mesh<f64>, part| {
            let (still, moved) = (of_part(shape, part, still), of_part(shape, part, moved));
            let handles = Handles::new().fix(still).fix(moved);
            Session::new(shape, &handles, &DeformOptions::default()).unwrap()
        };
        let mut sessions = [session(&own, 0), session(&shape, body)];
        let mut seconds = [Vec::new(), Vec::new()];
        for frame in 1..=25 {
            for (session, seconds) in sessions.iter_mut().zip(&mut seconds) {
                let clock = Instant::now();
                session
                    .transform_handle(1, motion(f64::from(frame) / 25.0))
                    .unwrap();
                session.step().unwrap();
                seconds.push(clock.elapsed().as_secs_f64());
            }
        }
        let [alone, whole] = seconds.map(|mut times| {
            times.sort_by(f64::total_cmp);
            times[times.len() / 2]
        });
        println!("{name}: a frame {whole:.4} s, {alone:.4} s for the body alone");
        most = most.max(whole / alone);
    }
    assert!(most < 1.3, "{most}");
}
