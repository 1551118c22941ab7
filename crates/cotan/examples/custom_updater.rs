//! A scalar field of one's own: details that fade out along a sheet.
//!
//! The updater says how long every Laplacian coordinate is to be in the next step, nothing else;
//! the flow finds the shape. Here the bumps of a sheet keep their size on the left and are asked to
//! vanish on the right.
//!
//! `cargo run -p cotan --example custom_updater`

use std::ops::ControlFlow;

use cotan::flow::{FlowError, FlowState, Limited, ScalarFieldUpdater};
use cotan::geometry::{Mesh, scalar};
use cotan::linear::Handle;
use cotan::prelude::*;

/// d_i = f(x_i) |ℓ⁰_i|, f falling from 1 to 0 over the middle third of the bounding box.
struct FadeOut;

impl<T: Scalar> ScalarFieldUpdater<T> for FadeOut {
    fn update(
        &mut self,
        state: &FlowState<'_, T>,
        field: &mut VertexMap<T>,
    ) -> Result<(), FlowError> {
        for (v, magnitude) in state.rest().magnitudes().iter() {
            // Box units: the lower corner of the original's bounding box is 0, its longest side 1.
            let x = state.rest().positions()[v].x;
            let fade = (scalar::<T>(2.0) - x * scalar(3.0)).clamp(T::zero(), T::one());
            field[v] = *magnitude * fade;
        }
        Ok(())
    }

    /// The field does not follow the shape, so one update is enough where a step would need two.
    fn is_constant(&self) -> bool {
        true
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shape = cotan::shapes::bumpy_plane::<f64>([2.0, 1.0], [60, 30], 0.1);
    // The left and right edges hold the sheet; the two long ones are free.
    let ends = shape.surface().vertices_where(|p| p.x.abs() > 0.999);

    let mut flow = Flow::builder(shape.connectivity(), shape.positions())
        .updater(FadeOut)
        // The default energy has a membrane, which would pull the bumps back.
        .orientation(Limited::new())
        .handles(
            ends.iter()
                .map(|&v| (Handle::hard(v), shape.positions()[v])),
        )
        .build()?;
    let report = flow.run(|_, _| ControlFlow::Continue(()))?;
    println!("{} after {} iterations", report.stop, report.iterations);

    let positions = flow.positions();
    for (name, side) in [("left", -1.0), ("right", 1.0)] {
        let [before, after] = [shape.positions(), &positions].map(|p| height(&shape, p, side));
        println!("{name} third: bumps of {before:.4} before, {after:.4} after");
    }
    Ok(())
}

/// Root mean square of the height over the third of the sheet on one side.
fn height(shape: &Mesh<f64>, positions: &Positions<f64>, side: f64) -> f64 {
    let third = shape.surface().vertices_where(|p| p.x * side >= 1.0 / 3.0);
    let sum: f64 = third.iter().map(|&v| positions[v].z.powi(2)).sum();
    (sum / third.len() as f64).sqrt()
}
