//! Handles of a single vertex.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use cotan::linear::Strategy;
use cotan::prelude::*;
use cotan::shapes::{icosphere, torus};
use nalgebra::{Translation3, Vector3};

fn farthest(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
    let pairs = a.values().zip(b.values());
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// The largest change of a dihedral angle in degrees.
fn spike(shape: &Mesh<f64>, moved: &Positions<f64>) -> f64 {
    let surface = shape.surface();
    let quality = Quality::measure(&surface, &surface.with_positions(moved)).unwrap();
    quality.max_dihedral_change
}

/// A ball that is held below and pulled at its top vertex.
fn pulled_ball() -> (Mesh<f64>, VertexId, Handles<f64>) {
    let shape = icosphere::<f64>(4);
    let low = shape.surface().vertices_where(|p| p.z < -0.7);
    let top = shape.surface().vertices_where(|p| p.z > 1.0 - 1e-9)[0];
    let up = Translation3::new(0.0, 0.0, 0.5).to_homogeneous();
    let handles = Handles::new().fix(low).transform([top], up);
    (shape, top, handles)
}

/// A single vertex takes the surface around it along, and arrives exactly, with a region as the
/// other handle.
#[test]
fn a_point_handle_leaves_no_cone() {
    let (shape, top, handles) = pulled_ball();
    let options = DeformOptions::default();
    let mut at_vertex = Stiffness::SOLID;
    at_vertex.point_radius = 0.0;
    let cone = deform(&shape, &handles, &options.clone().stiffness(at_vertex)).unwrap();
    let smooth = deform(&shape, &handles, &options).unwrap();
    assert_eq!(smooth.report.stop, StopReason::Converged);
    assert!(smooth.report.iterations <= 2 * cone.report.iterations);
    let [before, after] = [&cone, &smooth].map(|d| spike(&shape, &d.positions));
    assert!(after <= 0.65 * before, "{after} {before}");
    let wanted = shape.positions()[top] + Vector3::z() * 0.5;
    assert!((smooth.positions[top] - wanted).norm() < 1e-12);
    for v in handles.vertices().flatten().filter(|v| **v != top) {
        assert_eq!(smooth.positions[*v], shape.positions()[*v]);
    }
}

/// The system knows nothing of the discs, whatever solves it.
#[test]
fn point_handles_are_the_same_by_all_strategies() {
    let (shape, _, handles) = pulled_ball();
    let run = |strategy| {
        let options = DeformOptions::default().tolerance(1e-7);
        let options = options.clone().system(options.system.strategy(strategy));
        deform(&shape, &handles, &options).unwrap().positions
    };
    let normal = run(Strategy::Normal);
    for strategy in [Strategy::Columns, Strategy::Iterative] {
        let gap = farthest(&run(strategy), &normal);
        assert!(gap < 1e-5, "{strategy}: {gap}");
    }
}

/// Point handles that a session exchanges are those of a new session.
#[test]
fn point_handles_are_exchanged() {
    let shape = torus::<f64>(1.0, 0.4, 60, 30);
    let at = |x: f64, y: f64| {
        let far = |p: &Point3<f64>| (p.x - x).hypot(p.y - y);
        let nearest = shape
            .positions()
            .iter()
            .min_by(|a, b| far(a.1).total_cmp(&far(b.1)));
        nearest.unwrap().0
    };
    let up = Translation3::new(0.0, 0.0, 0.4).to_homogeneous();
    let first = Handles::new()
        .fix([at(-1.4, 0.0), at(0.0, -1.4)])
        .transform([at(1.4, 0.0)], up);
    let second = Handles::new()
        .fix([at(-1.4, 0.0), at(0.0, -1.4), at(0.0, 1.4)])
        .transform([at(1.0, 1.0)], up);
    let options = DeformOptions::default().tolerance(1e-7);
    let mut session = Session::new(&shape, &first, &options).unwrap();
    let _ = session.run().unwrap();
    session.set_handles(&second).unwrap();
    assert_eq!(session.run().unwrap().stop, StopReason::Converged);
    let fresh = deform(&shape, &second, &options).unwrap();
    let gap = farthest(&session.positions(), &fresh.positions);
    assert!(gap < 1e-3, "{gap}");
}
