//! A minimal program: bends a bar by its two ends and reports the quality of the result.
//!
//! `cargo run -p cotan --example deform`

use cotan::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Any triangle mesh with one position per vertex works. Sample shapes need no file.
    let shape = cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
    let left = shape.surface().vertices_where(|p| p.x < -1.99);
    let right = shape.surface().vertices_where(|p| p.x > 1.99);

    // One end stays; the other is raised by 1 and rotated by 0.7 radians about z.
    let turn = Isometry3::new(Vector3::new(0.0, 1.0, 0.0), Vector3::new(0.0, 0.0, 0.7));
    let handles = Handles::new()
        .fix(left)
        .transform(right, turn.to_homogeneous());

    let deformed = deform(&shape, &handles, &DeformOptions::default())?;
    // Reaching the iteration limit is not an error; the report shows it.
    println!(
        "{} after {} iterations",
        deformed.report.stop, deformed.report.iterations
    );

    let now = shape.surface().with_positions(&deformed.positions);
    let quality = Quality::measure(&shape.surface(), &now)?;
    println!(
        "E_p {:.4}, E_g {:.4}",
        quality.errors.parameterization, quality.errors.geometry
    );
    println!(
        "edges changed by {:.2} %, rms",
        100.0 * quality.edge_distortion_rms
    );
    Ok(())
}
