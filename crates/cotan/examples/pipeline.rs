//! A scan becomes a posed model: load, repair, decimate, remesh, smooth, deform, save.
//!
//! `cargo run --release -p cotan --example pipeline -- SCAN.obj POSED.obj`

use cotan::nalgebra::UnitQuaternion;
use cotan::prelude::*;
use cotan::smooth::{BumpSize, BySizeOptions, smooth_by_size};
use cotan::surface::{DecimateOptions, RemeshOptions, decimate, remesh};
use cotan_io::{Document, Filling, Repair};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let files: Vec<_> = std::env::args_os().skip(1).collect();
    let [input, output] = files.as_slice() else {
        return Err("usage: pipeline SCAN.obj POSED.obj".into());
    };
    let repair = Repair::all().drop_parts_below(100);
    let repair = repair.fill_holes(Filling::SMOOTH);
    let scan = repair.apply(&cotan_io::load(input)?)?.document.surface()?;

    // About 8000 faces, then edges of even length, then no bump narrower than 5 % of the model.
    let size = scan.surface().bounding_box().longest_side();
    let fewer = decimate(&scan.surface(), &DecimateOptions::to_faces(8000))?.mesh;
    let even = remesh(&fewer.surface(), &RemeshOptions::uniform(0.015 * size))?.mesh;
    let (bumps, options) = (BumpSize::Share(0.05), BySizeOptions::default());
    let smooth = smooth_by_size(&even, &Handles::new(), &bumps, &options)?;
    let model = even.with_positions(smooth.positions)?;

    // The feet stay, the head turns and looks up.
    let feet = model.surface().vertices_where(|p| p.y < 0.2);
    let head = model.surface().vertices_where(|p| p.x > 0.6 && p.y > 1.3);
    let (axis, neck) = (Vector3::new(0.0, 0.8, 0.3), Point3::new(0.6, 1.3, 0.0));
    let turn = Isometry3::rotation_wrt_point(UnitQuaternion::new(axis), neck);
    let handles = Handles::new().fix(feet);
    let handles = handles.transform(head, turn.to_homogeneous());
    let posed = deform(&model, &handles, &DeformOptions::default())?.positions;
    let document = Document::from_mesh(model.connectivity(), &posed)?;
    cotan_io::save(&document, output)?;
    Ok(())
}
