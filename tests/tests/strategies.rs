//! The strategies of the linear system in whole deformations: they affect the speed, not the
//! result.

use cotan::linear::{Method, Strategy, SystemOptions};
use cotan::prelude::*;
use cotan_geometry::{Mesh, shapes};

/// Point handles: fixed feet and a pulled head.
fn handles(shape: &Mesh<f64>) -> Handles<f64> {
    let n = shape.num_vertices();
    let extreme = |key: &dyn Fn(&Point3<f64>) -> f64| {
        let ids = shape.connectivity().vertices();
        ids.max_by(|a, b| key(&shape.positions()[*a]).total_cmp(&key(&shape.positions()[*b])))
            .expect("a vertex")
    };
    let ends = [
        extreme(&|p| p.x),
        extreme(&|p| -p.x),
        extreme(&|p| p.y),
        extreme(&|p| -p.y),
        extreme(&|p| -p.z),
        VertexId::new(n / 2),
    ];
    let top = extreme(&|p| p.z);
    let pulled = shape.positions()[top] + Vector3::new(0.3, 0.1, 0.2);
    Handles::new().fix(ends).move_to(top, pulled)
}

fn options(strategy: Strategy) -> DeformOptions {
    DeformOptions::default().system(SystemOptions::new().strategy(strategy))
}

/// The largest distance, over the longest side of the box.
fn apart(shape: &Mesh<f64>, a: &Positions<f64>, b: &Positions<f64>) -> f64 {
    let distance = a.values().zip(b.values()).map(|(a, b)| (a - b).norm());
    distance.fold(0.0, f64::max) / shape.surface().bounding_box().longest_side()
}

#[test]
fn a_deformation_is_the_same_by_both_strategies() {
    let shape = shapes::creature::<f64>(40);
    let handles = handles(&shape);
    for orientation in [OrientationKind::Hybrid, OrientationKind::Limited] {
        for scheme in [SchemeKind::Cotangent, SchemeKind::Tutte] {
            // The hybrid's membrane uses cotangents. With other weights columns do not apply.
            if orientation == OrientationKind::Hybrid && scheme == SchemeKind::Tutte {
                continue;
            }
            let by = |strategy| {
                let options = options(strategy).orientation(orientation).scheme(scheme);
                deform(shape.surface(), &handles, &options).expect("deforms")
            };
            let (normal, columns) = (by(Strategy::Normal), by(Strategy::Columns));
            let apart = apart(&shape, &normal.positions, &columns.positions);
            println!(
                "{orientation:?} {scheme:?}: {} and {} iterations, {apart:.1e} apart",
                normal.report.iterations, columns.report.iterations
            );
            assert!(apart < 1e-6);
            assert_eq!(normal.report.iterations, columns.report.iterations);
            assert_eq!(normal.report.stop, columns.report.stop);
        }
    }
}

#[test]
fn a_session_whose_handles_come_and_go_is_the_same_by_both_strategies() {
    let shape = shapes::creature::<f64>(30);
    let handles = handles(&shape);
    let by = |strategy| {
        let mut session =
            Session::new(shape.surface(), &handles, &options(strategy)).expect("a session");
        assert_eq!(session.run().expect("runs").stop, StopReason::Converged);
        let vertex = VertexId::new(shape.num_vertices() / 3);
        let pulled = session.positions()[vertex] + Vector3::new(0.0, 0.1, 0.0);
        let group = session
            .add_handle([vertex], Motion::To(vec![pulled]))
            .expect("a handle");
        assert_eq!(session.run().expect("runs").stop, StopReason::Converged);
        assert_eq!(session.positions()[vertex], pulled);
        session.remove_handle(group).expect("the handle is there");
        let report = session.run().expect("runs");
        assert_eq!(
            report.solver.map(|choice| choice.method.into()),
            Some(strategy)
        );
        session.positions()
    };
    let apart = apart(&shape, &by(Strategy::Normal), &by(Strategy::Columns));
    println!("{apart:.1e} apart");
    assert!(apart < 1e-6);
}

#[test]
fn few_points_take_columns_and_a_region_takes_the_normal_equations() {
    let shape = shapes::creature::<f64>(40);
    let chosen = |handles: &Handles<f64>| {
        let session = Session::new(shape.surface(), handles, &DeformOptions::default());
        session.expect("a session").flow().system().choice().method
    };
    assert_eq!(chosen(&handles(&shape)), Method::Columns);
    let half = shape.surface().vertices_where(|p| p.x > 0.0);
    assert_eq!(chosen(&Handles::new().fix(half)), Method::Normal);
}
