//! Handles that come and go, and regions of interest.

use cotan_flow::{Flow, FlowError, StopReason};
use cotan_geometry::{Mesh, shapes};
use cotan_halfedge::VertexId;
use cotan_linear::{Handle, LinearError, Strategy, SystemOptions};
use nalgebra::{Point3, Vector3};

fn at(shape: &Mesh<f64>, vertex: usize, lift: f64) -> (Handle, Point3<f64>) {
    let vertex = VertexId::new(vertex);
    let target = shape.positions()[vertex] + Vector3::new(0.0, 0.0, lift);
    (Handle::hard(vertex), target)
}

#[test]
fn an_added_handle_is_met_and_a_removed_one_lets_go() {
    let shape = shapes::icosphere::<f64>(3);
    // Three that stand, so that nothing is left to turn about.
    let few = [
        at(&shape, 0, 0.0),
        at(&shape, 1, 0.0),
        at(&shape, 2, 0.0),
        at(&shape, 3, 0.2),
    ];
    let more = [few[0], few[1], few[2], few[3], at(&shape, 11, 0.05)];
    for strategy in [Strategy::Normal, Strategy::Columns] {
        let mut flow = Flow::builder(shape.connectivity(), shape.positions())
            .handles(few)
            .system(SystemOptions::new().strategy(strategy))
            .tolerance(1e-8)
            .iteration_limit(2000)
            .build()
            .unwrap();
        assert_eq!(flow.run_to_end().unwrap().stop, StopReason::Converged);
        let before = flow.positions();
        flow.set_handles(&more).unwrap();
        let report = flow.run_to_end().unwrap();
        assert_eq!(
            report.solver.map(|choice| choice.method.into()),
            Some(strategy)
        );
        let now = flow.positions();
        assert!(
            more.iter()
                .all(|(handle, target)| now[handle.vertex] == *target)
        );
        // A handle may be moved by its number in the new list.
        flow.move_handles(&[(more[4].0.vertex, more[4].1)]).unwrap();
        // Without it the flow returns to where it was.
        flow.set_handles(&few).unwrap();
        assert_eq!(flow.run_to_end().unwrap().stop, StopReason::Converged);
        let moved = before
            .values()
            .zip(flow.positions().values())
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f64::max);
        assert!(moved < 1e-5, "{moved}");
    }
}

#[test]
fn refused_handles_change_nothing() {
    let shape = shapes::icosphere::<f64>(2);
    let few = [at(&shape, 0, 0.0), at(&shape, 3, 0.2)];
    let mut flow = Flow::builder(shape.connectivity(), shape.positions())
        .handles(few)
        .build()
        .unwrap();
    flow.step().unwrap();
    let before = flow.positions();
    assert_eq!(
        flow.set_handles(&[]),
        Err(FlowError::Linear(LinearError::NoHandles))
    );
    let far = VertexId::new(10_000);
    assert!(
        flow.set_handles(&[few[0], (Handle::hard(far), few[0].1)])
            .is_err()
    );
    let nowhere = Point3::new(f64::NAN, 0.0, 0.0);
    assert!(flow.set_handles(&[(few[0].0, nowhere)]).is_err());
    assert_eq!(flow.handles().len(), 2);
    assert_eq!(flow.positions(), before);
    // The same handles once more are no change, so that a converged flow stays converged.
    assert_eq!(flow.run_to_end().unwrap().stop, StopReason::Converged);
    let settled = flow.positions();
    flow.set_handles(&few).unwrap();
    assert_eq!(flow.positions(), settled);
}

#[test]
fn outside_of_the_region_nothing_moves_and_nothing_is_factorized() {
    let shape = shapes::icosphere::<f64>(3);
    let region = shape.surface().vertices_where(|p| p.z > 0.3);
    let top = region
        .iter()
        .copied()
        .max_by(|a, b| shape.positions()[*a].z.total_cmp(&shape.positions()[*b].z))
        .unwrap();
    let mut flow = Flow::builder(shape.connectivity(), shape.positions())
        .handles([at(&shape, top.index(), 0.4)])
        .region(region.iter().copied())
        .build()
        .unwrap();
    assert_eq!(flow.system().num_unknowns(), region.len() - 1);
    assert_eq!(flow.handles().len(), 1);
    assert_eq!(flow.run_to_end().unwrap().stop, StopReason::Converged);
    let check = |flow: &Flow<f64>, target: Point3<f64>| {
        let now = flow.positions();
        let is_inside = |v: VertexId| region.contains(&v);
        assert_eq!(now[top], target);
        let moved = |v: &VertexId| now[*v] != shape.positions()[*v];
        assert!(
            shape
                .connectivity()
                .vertices()
                .filter(|&v| !is_inside(v))
                .all(|v| !moved(&v))
        );
        assert!(region.iter().filter(|v| moved(v)).count() > region.len() / 2);
    };
    check(&flow, shape.positions()[top] + Vector3::new(0.0, 0.0, 0.4));
    // Other handles leave the region what it is.
    let again = at(&shape, top.index(), -0.1);
    flow.set_handles(&[(Handle::soft(top, 50.0), again.1)])
        .unwrap();
    assert_eq!(flow.system().num_unknowns(), region.len());
    flow.set_handles(&[again]).unwrap();
    assert_eq!(flow.run_to_end().unwrap().stop, StopReason::Converged);
    check(&flow, again.1);
}

#[test]
fn a_region_of_missing_vertices_is_refused() {
    let shape = shapes::icosphere::<f64>(1);
    let refused = Flow::builder(shape.connectivity(), shape.positions())
        .region([VertexId::new(42)])
        .build();
    assert_eq!(
        refused.map(|_| ()),
        Err(FlowError::RegionOutOfRange {
            vertex: VertexId::new(42),
            num_vertices: 42
        })
    );
}
