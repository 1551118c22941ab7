//! A recipe of the book: bumps that fade out along a sheet, by a scalar field updater.
//!
//! ```text
//! recipe_fading_bumps SHEET OUT
//! ```

use std::error::Error;

use cotan::prelude::*;

/// d_i = f(x_i) |ℓ⁰_i|: f falls from 1 to 0 over the middle third of the bounding box.
struct FadeOut;

impl ScalarFieldUpdater<f64> for FadeOut {
    fn update(
        &mut self,
        state: &FlowState<'_, f64>,
        field: &mut VertexMap<f64>,
    ) -> Result<(), FlowError> {
        for (v, magnitude) in state.rest().magnitudes().iter() {
            let fade = (2.0 - 3.0 * state.rest().positions()[v].x).clamp(0.0, 1.0);
            field[v] = magnitude * fade;
        }
        Ok(())
    }

    fn is_constant(&self) -> bool {
        true
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(input), Some(output)) = (arguments.next(), arguments.next()) else {
        return Err("usage: recipe_fading_bumps SHEET OUT".into());
    };
    let mut document = cotan_io::load(input)?;
    let mesh = document.surface()?;
    let surface = mesh.surface();
    let ends = surface.vertices_where(|p| p.x.abs() > 0.999);

    let flow = Flow::builder(mesh.mesh(), mesh.positions()).updater(FadeOut);
    let flow = flow.orientation(Limited::new());
    let faded = deform_with(flow, &Handles::new().fix(ends))?;
    println!(
        "{} after {} iterations",
        faded.report.stop, faded.report.iterations
    );
    document.set_positions(&mesh, &faded.positions)?;
    cotan_io::save(&document, output)?;
    Ok(())
}
