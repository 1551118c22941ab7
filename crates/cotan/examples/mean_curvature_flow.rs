//! Implicit mean-curvature flow (Desbrun et al. 1999): a unit sphere shrinks to radius √(1 − 4t).
//!
//! ```text
//! (2A/t − L) x = 2A/t x₀        A: areas of the vertices, L without the factor ½
//! ```
//!
//! Areas and weights follow the surface, while the matrix pattern is analysed only once.
//!
//! `cargo run -p cotan --example mean_curvature_flow`

use cotan::laplacian::{Cotangent, Operator};
use cotan::linear::LinearSystem;
use cotan::prelude::*;

const TIME_STEP: f64 = 1e-3;
const STEPS: usize = 100;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut ball = cotan::shapes::icosphere::<f64>(3);
    let mut system = None;
    for _ in 0..STEPS {
        let operator = Operator::assemble(&Cotangent::default(), &ball.surface())?;
        let masses = ball
            .surface()
            .dual_areas()
            .map(|area| 2.0 * area / TIME_STEP);
        let system = match &mut system {
            None => system.insert(LinearSystem::screened(&operator, masses.as_slice(), &[])?),
            Some(system) => {
                system.set_screened(&operator, masses.as_slice())?;
                system
            }
        };
        let mut x = VertexMap::from_fn(masses.len(), |v| ball.positions()[v].coords * masses[v]);
        system.solve_in_place(&mut x);
        ball = ball.with_positions(x.map(|x| Point3::from(*x)))?;
    }
    let time = TIME_STEP * STEPS as f64;
    let exact = (1.0 - 4.0 * time).sqrt();
    let norms = ball.positions().values().map(|p| p.coords.norm());
    let radius = norms.sum::<f64>() / ball.positions().len() as f64;
    println!("radius after a time of {time:.1}: {radius:.4}, exactly {exact:.4}");
    assert!((radius - exact).abs() < 0.01);
    Ok(())
}
