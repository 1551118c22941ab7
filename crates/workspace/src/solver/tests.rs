use std::time::Duration;

use cotan::geometry::Surface;
use cotan::halfedge::VertexId;
use nalgebra::{Matrix4, Vector3};

use cotan_io::ProcessingMesh;

use super::*;
use crate::handle::HandleGroup;
use crate::handle::{Role, job_handles};
use crate::scene::Props;
use crate::settings::{Influence, editor_options};

fn mesh() -> Arc<ProcessingMesh> {
    let shape = cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
    let document = cotan_io::Document::from_mesh(shape.connectivity(), shape.positions()).unwrap();
    Arc::new(document.surface().unwrap())
}

fn goal(mesh: &Arc<ProcessingMesh>, rest: &Shape, tag: u64, lift: f64, pace: Pace) -> Goal {
    let at = |side: f64| -> Vec<VertexId> {
        let all = rest.iter().filter(|(_, p)| p.x * side > 1.99);
        all.map(|(v, _)| v).collect()
    };
    let group = |vertices, role| HandleGroup::new(String::new(), vertices, role, rest, rest);
    let mut moved = group(at(1.0), Role::Movable);
    moved.matrix = Matrix4::new_translation(&Vector3::new(0.0, 0.0, lift));
    Goal {
        tag,
        mesh: Arc::clone(mesh),
        rest: rest.clone(),
        props: Arc::new(Props {
            handles: vec![group(at(-1.0), Role::Fixed), moved],
            ..Props::default()
        }),
        shape: None,
        pace,
        posted: Instant::now(),
    }
}

/// Waits until the solver is done with `tag` and returns its last update.
fn settled(solver: &mut Solver, tag: u64) -> Update {
    let deadline = Instant::now() + Duration::from_secs(60);
    let mut last: Option<Update> = None;
    loop {
        assert!(Instant::now() < deadline, "{:?}", solver.state());
        if let Some(update) = solver.take() {
            assert!(last.is_none_or(|l| l.tag <= update.tag));
            last = Some(update);
        }
        if let Some(update) = &last
            && update.tag == tag
            && update.state == State::Settled
        {
            return update.clone();
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn the_newest_goal_wins_and_its_shape_is_that_of_a_job() {
    let mesh = mesh();
    let rest = Shape::new(mesh.positions().clone());
    let mut solver = Solver::start(|| {}).unwrap();
    for tag in 0..=50 {
        solver.post(goal(&mesh, &rest, tag, 0.02 * tag as f64, Pace::Held));
        std::thread::sleep(Duration::from_micros(300));
    }
    let last = goal(&mesh, &rest, 51, 1.0, Pace::Settle);
    solver.post(last.clone());
    let update = settled(&mut solver, 51);
    let job = cotan::deform(
        Surface::assume_checked(mesh.mesh(), &rest),
        &job_handles(last.handles(), &[]),
        &editor_options(),
    )
    .unwrap();
    let pairs = update.shape.values().zip(job.positions.values());
    let farthest = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(farthest < 4e-6, "{farthest:e}");
    assert!(!solver.samples().is_empty());
}

#[test]
fn only_the_region_of_influence_moves() {
    let mesh = mesh();
    let rest = Shape::new(mesh.positions().clone());
    let mut local = goal(&mesh, &rest, 1, 0.4, Pace::Settle);
    let props = Arc::make_mut(&mut local.props);
    props.settings.follow.influence = Some(Influence {
        radius: 0.25,
        falloff: 0.5,
    });
    let mut solver = Solver::start(|| {}).unwrap();
    solver.post(local);
    let update = settled(&mut solver, 1);
    for (v, p) in rest.iter() {
        let now = update.shape[v];
        match p.x {
            // A quarter of the longest side, which is 4, before the end at 2.
            x if x < 0.99 => assert_eq!(now, *p),
            x if x > 1.99 => assert!((now - p - Vector3::new(0.0, 0.0, 0.4)).norm() < 1e-9),
            _ => {}
        }
    }
    let lifted = rest.iter().filter(|(v, p)| update.shape[*v].z > p.z + 0.05);
    assert!(lifted.count() > 25, "more than the handle itself");
}

#[test]
fn a_still_goal_touches_nothing_and_a_panic_is_survived() {
    let mesh = mesh();
    let rest = Shape::new(mesh.positions().clone());
    let mut solver = Solver::start(|| {}).unwrap();
    solver.post(goal(&mesh, &rest, 1, 0.5, Pace::Settle));
    let _ = settled(&mut solver, 1);
    let still = goal(&mesh, &rest, 2, 0.1, Pace::Still);
    solver.post(still.clone());
    std::thread::sleep(Duration::from_millis(100));
    assert!(solver.take().is_none());
    solver.provoke_panic();
    solver.post(Goal {
        tag: 3,
        pace: Pace::Settle,
        ..still.clone()
    });
    let deadline = Instant::now() + Duration::from_secs(20);
    while !matches!(solver.state().0, State::Failed(_)) {
        assert!(Instant::now() < deadline);
        std::thread::sleep(Duration::from_millis(1));
    }
    solver.post(Goal {
        tag: 4,
        pace: Pace::Settle,
        ..still
    });
    let _ = settled(&mut solver, 4);
}
