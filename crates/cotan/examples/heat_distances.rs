//! A method from a paper on the linear layer: geodesic distances by the heat method (Crane,
//! Weischedel, Wardetzky 2013). Heat diffuses for a short time, and its normalized gradients are
//! those of the distance.
//!
//! `cotan::surface::GeodesicDistances` does this for you, and more accurately.
//!
//! L has no factor ½, so the areas and the divergence have none either.
//!
//! `cargo run -p cotan --example heat_distances`

use cotan::geometry::{face_area_vector, triangle_cotangents};
use cotan::laplacian::{Cotangent, Operator};
use cotan::linear::LinearSystem;
use cotan::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ball = cotan::shapes::icosphere::<f64>(4);
    let (surface, source) = (ball.surface(), VertexId::new(0));
    let operator = Operator::assemble(&Cotangent::default(), &surface)?;

    let time = surface.mean_edge_length().powi(2);
    let masses = surface.dual_areas().map(|area| 2.0 * area / time);
    let mut heat = VertexMap::filled(ball.positions().len(), 0.0);
    heat[source] = 1.0;
    let heat = LinearSystem::screened(&operator, masses.as_slice(), &[])?.solve(&heat);

    let mut divergence = VertexMap::filled(ball.positions().len(), 0.0);
    for f in ball.connectivity().faces() {
        let (v, normal) = (
            ball.connectivity().triangle(f),
            face_area_vector(&surface, f),
        );
        let p = v.map(|v| ball.positions()[v]);
        let cot = triangle_cotangents(&p[0], &p[1], &p[2]);
        let edge = |from: usize, to: usize| p[to % 3] - p[from % 3];
        let slope = |k: usize| normal.cross(&edge(k + 1, k + 2)) * heat[v[k]];
        let away = -(slope(0) + slope(1) + slope(2)).normalize();
        for k in 0..3 {
            let (next, last) = (edge(k, k + 1).dot(&away), edge(k, k + 2).dot(&away));
            divergence[v[k]] += cot[(k + 2) % 3] * next + cot[(k + 1) % 3] * last;
        }
    }
    // −L φ = −div, with φ = 0 at the source.
    let mut given = divergence.map(|d| -d);
    given[source] = 0.0;
    let distances = LinearSystem::poisson(&operator, &[source])?.solve(&given);

    // On a unit sphere the distance equals the angle.
    let pole = ball.positions()[source].coords;
    let angle = |v| ball.positions()[v].coords.angle(&pole);
    let errors = distances.iter().map(|(v, d)| (d - angle(v)).abs());
    let mean = errors.sum::<f64>() / distances.len() as f64;
    println!("distances on a unit sphere: mean error {mean:.4}");
    assert!(mean < 0.03);
    Ok(())
}
