//! The whole pipeline on an untrusted file: read, repair, deform, write.

use cotan::prelude::*;
use cotan_io::{Document, Repair, Weld, read};

use super::draw::Draw;
use super::files::{announces_another, limits};

/// Deforms a file with two handles: either the result is finite and can be saved, or there is an
/// error.
///
/// The first bytes choose the options; the rest is the file.
pub fn pipeline(data: &[u8]) {
    let Some((choice, file)) = data.split_at_checked(4) else {
        return;
    };
    let mut draw = Draw::new(choice);
    let limits = cotan_io::Limits {
        max_vertices: 1000,
        max_faces: 2000,
        max_corners: 6000,
        ..limits()
    };
    let Ok(document) = read(file, None, &limits) else {
        return;
    };
    let options = DeformOptions::default()
        .scheme(SchemeKind::ALL[draw.below(SchemeKind::ALL.len())])
        .orientation(OrientationKind::ALL[draw.below(OrientationKind::ALL.len())])
        .iteration_limit(4);
    let document = match draw.below(2) {
        0 => document,
        _ => match Repair::default().apply(&document) {
            Ok(repaired) => repaired.document,
            Err(_) => return,
        },
    };
    match draw.below(2) {
        0 => deform_by::<f64>(document, &options),
        _ => deform_by::<f32>(document, &options),
    }
}

fn deform_by<T: Scalar>(mut document: Document, options: &DeformOptions) {
    let Ok(surface) = document.surface_in_pieces(Weld::AsFormat) else {
        return;
    };
    let mesh = surface.mesh();
    let positions = surface.positions().map(|p| p.map(T::of_f64));
    let (fixed, held) = (VertexId::new(0), VertexId::new(mesh.num_vertices() - 1));
    // A handle in every component, so that files with several components also pass.
    let components = mesh.components();
    let mut is_held = vec![false; components.count()];
    let anchors: Vec<VertexId> = mesh
        .vertices()
        .filter(|&v| !std::mem::replace(&mut is_held[components.of(v)], true))
        .filter(|&v| v != held && v != fixed)
        .collect();
    let target = positions[held] + Vector3::from([T::of_f64(0.5); 3]);
    let handles = Handles::new()
        .fix([fixed])
        .fix(anchors)
        .move_to(held, target);
    let Ok(mut session) =
        Session::new(Surface::assume_checked(mesh, &positions), &handles, options)
    else {
        return;
    };
    let Ok(report) = session.run() else { return };
    let moved = session.positions();
    for p in moved.values() {
        assert!(p.iter().all(|x| x.is_finite()), "{report:?}");
    }
    assert_eq!(moved[held], target, "a hard handle is met");
    document
        .set_positions(&surface, &moved)
        .unwrap_or_else(|error| panic!("{error}"));
    let Some(format) = document.format() else {
        return;
    };
    let Ok(bytes) = document.write(format) else {
        return;
    };
    if announces_another(&bytes, format) {
        return;
    }
    read(bytes, Some(format), &limits()).unwrap_or_else(|error| panic!("{error}"));
}
