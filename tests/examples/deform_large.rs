//! Deforms an irregular mesh of millions of vertices by six points, and prints time and peak
//! memory.
//!
//! ```text
//! cargo run --release -p cotan-tests --example deform_large [-- VERTICES [ORIENTATION [single]]]
//! ```

use std::error::Error;
use std::time::Instant;

use cotan::linear::{Precision, SystemOptions};
use cotan::prelude::*;
use cotan::shapes::{VertexOrder, irregular};

const AXES: [[f64; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, -1.0],
    [0.0, 0.0, 1.0],
];

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let size: usize = arguments.next().map_or(Ok(1_000_000), |n| n.parse())?;
    let orientation = arguments.next().unwrap_or("hybrid".into()).parse()?;
    let precision = match arguments.next().as_deref() {
        Some("single") => Precision::Single,
        _ => Precision::Double,
    };
    let clock = Instant::now();
    let told = |what: &str| {
        println!(
            "{what}: {:.1} s, peak {}",
            clock.elapsed().as_secs_f64(),
            peak()
        )
    };
    let shape = irregular::<f64>(size, VertexOrder::Natural, 6);
    told(&format!("{} vertices made", shape.positions().len()));
    // Five extreme points are fixed, and the sixth is pulled outwards by a fifth of its distance.
    let handles: Vec<(Handle, Point3<f64>)> = AXES
        .iter()
        .filter_map(|axis| {
            let along = |p: &Point3<f64>| p.coords.dot(&Vector3::from(*axis));
            let farthest = shape.positions().iter();
            let (vertex, p) = farthest.max_by(|a, b| along(a.1).total_cmp(&along(b.1)))?;
            let factor = if axis[2] > 0.5 { 1.2 } else { 1.0 };
            Some((Handle::hard(vertex), Point3::from(p.coords * factor)))
        })
        .collect();
    let options = DeformOptions::default()
        .orientation(orientation)
        .system(SystemOptions::new().precision(precision));
    let mut flow = options
        .apply(Flow::builder(shape.connectivity(), shape.positions()))
        .handles(handles)
        .build()?;
    told(&format!(
        "prepared, {} entries",
        flow.system().factor_entries()
    ));
    let report = flow.run(|_, step| {
        told(&format!(
            "iteration {}, change {:.1e}",
            step.iteration, step.change
        ));
        std::ops::ControlFlow::Continue(())
    })?;
    told(&format!("{report:?}"));
    Ok(())
}

/// The peak memory of the process, if the system reports it.
fn peak() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    line.map_or("unknown".into(), |line| {
        line["VmHWM:".len()..].trim().into()
    })
}
