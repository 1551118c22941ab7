//! An editor's loop: a handle moves every frame, and no frame may take long.
//!
//! A `Session` keeps the factorization, so that a frame costs a few solves. The observer breaks a
//! run when the frame's time is up; the next frame goes on from the shape reached so far.
//!
//! `cargo run -p cotan --example live_session`

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use cotan::prelude::*;

/// What a frame may spend on the shape.
const BUDGET: Duration = Duration::from_millis(10);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shape = cotan::shapes::cylinder::<f64>(0.3, 3.0, 24, 40);
    let bottom = shape.surface().vertices_where(|p| p.z < -1.4);
    let top = shape.surface().vertices_where(|p| p.z > 1.4);

    // Groups are numbered in the order in which they are added: the top is number 1.
    let handles = Handles::new().fix(bottom).add(top, Motion::Stay);
    let options = DeformOptions::default();
    let mut session = Session::new(&shape, &handles, &options)?;

    for frame in 1..=8 {
        // Motions are of the *original* positions, so that frames do not add up their errors.
        let t = f64::from(frame) / 8.0;
        let drag = Isometry3::new(
            Vector3::new(1.2 * t, 0.0, -0.5 * t),
            Vector3::y() * (1.2 * t),
        );
        session.transform_handle(1, drag.to_homogeneous())?;

        let start = Instant::now();
        let report = session.run_observed(|_, _| {
            // Whatever was reached by then is drawn: cancelled is not failed.
            if start.elapsed() < BUDGET {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        })?;
        println!(
            "frame {frame}: {}, iterations: {}",
            report.stop, report.iterations
        );
    }

    // One more vertex is taken hold of where it is by now, and pushed in: what was solved and
    // factorized for the others is kept.
    let middle = shape
        .surface()
        .vertices_where(|p| p.z.abs() < 0.05 && p.x > 0.29);
    let place = session.positions()[middle[0]] - Vector3::x() * 0.1;
    session.add_handle([middle[0]], Motion::To(vec![place]))?;

    // The hand lets go: there is time to finish.
    let report = session.run()?;
    println!(
        "released: {}, iterations: {}",
        report.stop, report.iterations
    );
    let positions = session.positions();
    let now = shape.surface().with_positions(&positions);
    if let Some(ratio) = Quality::measure(&shape.surface(), &now)?.volume_ratio {
        println!("volume: {:.1} % of the original's", 100.0 * ratio);
    }
    Ok(())
}
