//! The loop of an editor: a handle moves in every frame, and no frame may take long.
//!
//! A `Session` keeps the factorization, so a frame costs a few solves. The observer stops a run
//! when the time of the frame is up; the next frame continues from the current shape.
//!
//! `cargo run -p cotan --example live_session`

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use cotan::prelude::*;

/// The time budget of a frame.
const BUDGET: Duration = Duration::from_millis(10);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shape = cotan::shapes::cylinder::<f64>(0.3, 3.0, 24, 40);
    let bottom = shape.surface().vertices_where(|p| p.z < -1.4);
    let top = shape.surface().vertices_where(|p| p.z > 1.4);

    // Groups are numbered in the order in which they are added, so the top has id 1.
    let handles = Handles::new().fix(bottom).add(top, Motion::Stay);
    let options = DeformOptions::default();
    let mut session = Session::new(&shape, &handles, &options)?;

    for frame in 1..=8 {
        // Motions apply to the *original* positions, so errors do not accumulate over frames.
        let t = f64::from(frame) / 8.0;
        let drag = Isometry3::new(
            Vector3::new(1.2 * t, 0.0, -0.5 * t),
            Vector3::y() * (1.2 * t),
        );
        session.transform_handle(1, drag.to_homogeneous())?;

        let start = Instant::now();
        let report = session.run_observed(|_, _| {
            // The shape reached so far is drawn; a cancelled run is not a failure.
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

    // One more vertex is grabbed at its current position and pushed in. Solves and factorizations
    // for the other handles are reused.
    let middle = shape
        .surface()
        .vertices_where(|p| p.z.abs() < 0.05 && p.x > 0.29);
    let place = session.positions()[middle[0]] - Vector3::x() * 0.1;
    session.add_handle([middle[0]], Motion::To(vec![place]))?;

    // The handle is released, so there is time to finish.
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
