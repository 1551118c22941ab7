//! A harmonic field with fixed values. Between the rims of a cylinder it is linear in z, also on
//! the mesh.
//!
//! `cargo run -p cotan --example harmonic_field`

use cotan::laplacian::{Cotangent, Operator};
use cotan::linear::LinearSystem;
use cotan::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shape = cotan::shapes::cylinder::<f64>(0.5, 2.0, 48, 32);
    let surface = shape.surface();
    let operator = Operator::assemble(&Cotangent::default(), &surface)?;

    // Both caps are fixed to the values of a linear function.
    let exact = shape.positions().map(|p| 0.5 * (p.z + 1.0));
    let caps = surface.vertices_where(|p| p.z.abs() > 1.0 - 1e-9);
    let system = LinearSystem::poisson(&operator, &caps)?;
    let mut given = VertexMap::filled(exact.len(), 0.0);
    for &v in &caps {
        given[v] = exact[v];
    }
    let field = system.solve(&given);

    let errors = field.iter().map(|(v, u)| (u - exact[v]).abs());
    let largest = errors.fold(0.0, f64::max);
    let free = exact.len() - caps.len();
    println!("harmonic field at {free} free vertices: largest error {largest:.1e}");
    assert!(largest < 1e-9);
    Ok(())
}
