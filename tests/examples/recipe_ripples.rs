//! A recipe of the book: geodesic distances, shown as ripples on the surface.
//!
//! ```text
//! recipe_ripples MESH OUT
//! ```

use std::error::Error;

use cotan::prelude::*;
use cotan::surface::GeodesicDistances;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(input), Some(output)) = (arguments.next(), arguments.next()) else {
        return Err("usage: recipe_ripples MESH OUT".into());
    };
    let mut document = cotan_io::load(input)?;
    let mesh = document.surface()?;
    let surface = mesh.surface();
    // The vertex that is farthest along z.
    let height = |v: &VertexId| surface.position(*v).z;
    let source = surface.mesh().vertices();
    let source = source.max_by(|a, b| height(a).total_cmp(&height(b)));
    let source = source.ok_or("the mesh has no vertex")?;
    let distances = GeodesicDistances::new(surface)?.from_vertices(&[source])?;

    let farthest = distances.values().copied().fold(0.0, f64::max);
    println!("farthest from vertex {source}: {farthest:.3}");
    let edge = surface.mean_edge_length();
    let normals = surface.vertex_normals();
    let rippled = surface.positions().iter().map(|(v, p)| {
        let wave = (distances[v] / farthest * 16.0 * std::f64::consts::PI).cos();
        p + normals[v] * (0.3 * edge * wave)
    });
    document.set_positions(&mesh, &rippled.collect())?;
    cotan_io::save(&document, output)?;
    Ok(())
}
