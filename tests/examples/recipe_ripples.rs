//! A recipe of the book: geodesic distances by the heat method, shown as ripples on the surface.
//!
//! ```text
//! recipe_ripples MESH OUT
//! ```

use std::error::Error;

use cotan::geometry::{face_area_vector, triangle_cotangents};
use cotan::laplacian::{Cotangent, Operator};
use cotan::linear::LinearSystem;
use cotan::prelude::*;

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
    let distances = geodesic_distances(&surface, source)?;

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

/// K. Crane, C. Weischedel, M. Wardetzky, "Geodesics in heat", 2013: heat flows for a short time;
/// its gradients, all scaled to length 1, are the gradients of the distance.
fn geodesic_distances(
    surface: &Surface<'_, f64>,
    source: VertexId,
) -> Result<VertexMap<f64>, Box<dyn Error>> {
    let operator = Operator::assemble(&Cotangent::default(), surface)?;
    let time = surface.mean_edge_length().powi(2);
    let masses = surface.dual_areas().map(|area| 2.0 * area / time);
    let mut heat = VertexMap::filled(masses.len(), 0.0);
    heat[source] = 1.0;
    let heat = LinearSystem::screened(&operator, masses.as_slice(), &[])?.solve(&heat);

    let mut divergence = VertexMap::filled(masses.len(), 0.0);
    for face in surface.mesh().faces() {
        let v = surface.mesh().triangle(face);
        let normal = face_area_vector(surface, face);
        let p = v.map(|v| surface.position(v));
        let cot = triangle_cotangents(&p[0], &p[1], &p[2]);
        let edge = |from: usize, to: usize| p[to % 3] - p[from % 3];
        let slope = |k: usize| normal.cross(&edge(k + 1, k + 2)) * heat[v[k]];
        let away = -(slope(0) + slope(1) + slope(2)).normalize();
        for k in 0..3 {
            let (next, last) = (edge(k, k + 1).dot(&away), edge(k, k + 2).dot(&away));
            divergence[v[k]] += cot[(k + 2) % 3] * next + cot[(k + 1) % 3] * last;
        }
    }
    let mut given = divergence.map(|d| -d);
    given[source] = 0.0;
    Ok(LinearSystem::poisson(&operator, &[source])?.solve(&given))
}
