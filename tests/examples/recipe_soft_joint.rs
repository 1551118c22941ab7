//! A recipe of the book: a bar that is soft in the middle, by a Laplacian scheme.
//!
//! ```text
//! recipe_soft_joint BAR OUT
//! ```

use std::error::Error;

use cotan::prelude::*;

/// Cotangent weights times a stiffness at the middle of the edge.
struct SoftMiddle;

impl LaplacianScheme<f64> for SoftMiddle {
    fn weights(&self, s: &Surface<'_, f64>, out: &mut HalfedgeMap<f64>) -> Result<(), SchemeError> {
        Cotangent::default().weights(s, out)?;
        for h in s.mesh().halfedges() {
            let [a, b] = [s.mesh().origin(h), s.mesh().target(h)].map(|v| s.position(v).x);
            if (0.5 * (a + b)).abs() < 0.5 {
                out[h] *= 0.05;
            }
        }
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::Symmetric
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(input), Some(output)) = (arguments.next(), arguments.next()) else {
        return Err("usage: recipe_soft_joint BAR OUT".into());
    };
    let mut document = cotan_io::load(input)?;
    let mesh = document.surface()?;
    let surface = mesh.surface();
    let left = surface.vertices_where(|p| p.x < -2.99);
    let right = surface.vertices_where(|p| p.x > 2.99);
    let turn = Isometry3::rotation(Vector3::z() * 1.2).to_homogeneous();
    let handles = Handles::new().fix(left).transform(right, turn);

    // The default energy has a membrane that does not know the scheme; this orientation has none.
    let flow = Flow::builder(mesh.mesh(), mesh.positions()).scheme(SoftMiddle);
    let bent = deform_with(flow.orientation(BestRotation::new()), &handles)?;
    println!(
        "{} after {} iterations",
        bent.report.stop, bent.report.iterations
    );

    document.set_positions(&mesh, &bent.positions)?;
    cotan_io::save(&document, output)?;
    Ok(())
}
