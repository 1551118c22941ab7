//! A custom scalar field: details that fade out along a sheet.
//!
//! The updater only prescribes the length of each Laplacian coordinate in the next step; the flow
//! computes the shape. Here the bumps of a sheet keep their size on the left and vanish on the
//! right.
//!
//! `cargo run -p cotan --example custom_updater`

use std::ops::ControlFlow;

use cotan::flow::{FlowError, FlowState, Limited, ScalarFieldUpdater};
use cotan::geometry::{Mesh, scalar};
use cotan::linear::Handle;
use cotan::prelude::*;

/// d_i = f(x_i) |ℓ⁰_i|, where f falls from 1 to 0 over the middle third of the bounding box.
struct FadeOut;

impl<T: Scalar> ScalarFieldUpdater<T> for FadeOut {
    fn update(
        &mut self,
        state: &FlowState<'_, T>,
        field: &mut VertexMap<T>,
    ) -> Result<(), FlowError> {
        for (v, magnitude) in state.rest().magnitudes().iter() {
            // Box units: the lower corner of the original's bounding box is at 0, its longest
            // side is 1.
            let x = state.rest().positions()[v].x;
            let fade = (scalar::<T>(2.0) - x * scalar(3.0)).clamp(T::zero(), T::one());
            field[v] = *magnitude * fade;
        }
        Ok(())
    }

    /// The field does not depend on the current shape, so one update suffices where a step would
    /// need two.
    fn is_constant(&self) -> bool {
        true
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shape = cotan::shapes::bumpy_plane::<f64>([2.0, 1.0], [60, 30], 0.1);
    // The left and right edges hold the sheet; the two long edges are free.
    let ends = shape.surface().vertices_where(|p| p.x.abs() > 0.999);

    let mut flow = Flow::builder(shape.connectivity(), shape.positions())
        .updater(FadeOut)
        // The default energy has a membrane, which would restore the bumps.
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
