//! Runs a job on a mesh and prints its processor time, for comparisons with other libraries.
//!
//! ```text
//! cargo run --release -p cotan-surface --example peers -- decimate IN.off FACES OUT.off
//! cargo run --release -p cotan-surface --example peers -- remesh IN.off LENGTH OUT.off
//! cargo run --release -p cotan-surface --example peers -- bumps IN.off LEVEL OUT.off
//! ```
//!
//! `bumps` writes an icosphere with bumps. Files are OFF with one number after another.

use std::error::Error;
use std::fmt::Write;

use cotan_geometry::{Mesh, icosphere};
use cotan_surface::{DecimateOptions, RemeshOptions, decimate, remesh};
use cpu_time::ProcessTime;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [job, input, amount, output] = arguments.as_slice() else {
        return Err("give a job, a mesh, an amount and the result's name".into());
    };
    let amount: f64 = amount.parse()?;
    if job == "bumps" {
        return write(&bumps(amount as u32), output);
    }
    let mesh = read(input)?;
    let clock = ProcessTime::now();
    let made = match job.as_str() {
        "decimate" => decimate(&mesh.surface(), &DecimateOptions::to_faces(amount as usize))?.mesh,
        "remesh" => remesh(&mesh.surface(), &RemeshOptions::uniform(amount))?.mesh,
        _ => return Err("the job is decimate, remesh or bumps".into()),
    };
    println!("{} {}", clock.elapsed().as_secs_f64(), made.num_faces());
    made.connectivity().validate()?;
    write(&made, output)
}

fn bumps(level: u32) -> Mesh<f64> {
    let mut mesh = icosphere::<f64>(level);
    for p in mesh.positions_mut().iter_mut() {
        let wave = (9.0 * p.x).sin() * (11.0 * p.y).cos() + (7.0 * p.z).sin();
        let ripple = (40.0 * p.x).sin() * (40.0 * p.z).sin();
        *p *= 1.0 + 0.05 * wave + 0.004 * ripple;
    }
    mesh
}

fn read(path: &str) -> Result<Mesh<f64>, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let mut words = text.split_ascii_whitespace().skip(1);
    let mut number = || -> Result<f64, &str> {
        words
            .next()
            .and_then(|w| w.parse::<f64>().ok())
            .ok_or("a number is missing")
    };
    let (vertices, faces) = (number()? as usize, number()? as usize);
    number()?;
    let mut positions = vec![[0.0; 3]; vertices];
    for x in positions.iter_mut().flatten() {
        *x = number()?;
    }
    let mut corners = Vec::with_capacity(3 * faces);
    for _ in 0..faces {
        number()?;
        for _ in 0..3 {
            corners.push(number()? as u32);
        }
    }
    Ok(Mesh::from_triangles(&positions, &corners)?)
}

fn write(mesh: &Mesh<f64>, path: &str) -> Result<(), Box<dyn Error>> {
    let mut text = format!("OFF\n{} {} 0\n", mesh.num_vertices(), mesh.num_faces());
    for [x, y, z] in mesh.to_positions::<f64>() {
        writeln!(text, "{x} {y} {z}")?;
    }
    for t in mesh.to_triangles().chunks_exact(3) {
        writeln!(text, "3 {} {} {}", t[0], t[1], t[2])?;
    }
    Ok(std::fs::write(path, text)?)
}
