//! Edits of real meshes in an optional folder next to the workspace.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::path::PathBuf;

use cotan_io::{Repair, UV, Weld};
use nalgebra::Vector3;
use serde_json::Value;

use crate::sandbox::Sandbox;

/// The path of a mesh. Records the test as skipped if the file does not exist.
pub(crate) fn mesh(name: &str) -> Option<PathBuf> {
    cotan_testing::shared(&format!("meshes/{name}"))
}

#[test]
fn a_handle_on_one_component_of_the_ogre_leaves_the_others() {
    let Some(path) = mesh("ogre.obj") else { return };
    let document = cotan_io::load(&path).unwrap();
    let repaired = Repair::default().apply(&document).unwrap();
    let surface = repaired.document.surface().unwrap();
    let components = surface.mesh().components();
    let of_vertex = |v: usize| surface.vertex(v).map(|id| components.of(id));
    let before = repaired.document.positions();
    // A component of moderate size, so that the work is small, without copies among its vertices.
    let mut sizes = vec![0; components.count()];
    for id in surface.mesh().vertices() {
        sizes[components.of(id)] += 1;
    }
    let (chosen, _) = sizes
        .iter()
        .enumerate()
        .filter(|&(_, &size)| size >= 20)
        .min_by_key(|&(_, &size)| size)
        .unwrap();
    let handle = (0..document.positions().len())
        .find(|&v| of_vertex(v) == Some(chosen))
        .unwrap();
    let shift = Vector3::new(0.0, 0.5, 0.0);
    let target = before[handle] + shift;
    let sandbox = Sandbox::new();
    let source = repaired.vertex_sources[handle];
    sandbox.write(
        "h.txt",
        format!("{source} {} {} {}\n", target.x, target.y, target.z),
    );
    let line = format!(
        "deform {} --repair --handles h.txt -o o.obj --iterations 3 --parts still",
        path.display()
    );
    sandbox.cotan_ok(&line);
    let after = sandbox.positions("o.obj");
    assert_eq!(after.len(), before.len());
    for (v, (before, after)) in before.iter().zip(&after).enumerate() {
        if of_vertex(v) == Some(chosen) {
            // A single handle moves its whole component.
            assert!((after - before - shift).norm() < 1e-3, "{v}: {after}");
        } else {
            assert_eq!(before, after, "{v}");
        }
    }
}

/// The JSON of a GLB and the bytes of its images.
fn parts_of_glb(bytes: &[u8]) -> (Value, Vec<Vec<u8>>) {
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let length = number(12);
    let json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let binary = &bytes[28 + length..];
    let image = |image: &Value| {
        let view = &json["bufferViews"][image["bufferView"].as_u64().unwrap() as usize];
        let start = view["byteOffset"].as_u64().unwrap_or(0) as usize;
        binary[start..start + view["byteLength"].as_u64().unwrap() as usize].to_vec()
    };
    let images = json["images"].as_array().unwrap().iter().map(image);
    let images = images.collect();
    (json, images)
}

#[test]
fn the_duck_keeps_its_seams_closed_and_its_looks() {
    let Some(path) = mesh("duck.glb") else { return };
    let before = cotan_io::load(&path).unwrap();
    let heights = before.positions().iter().map(|p| p.y);
    let low = heights.clone().fold(f64::INFINITY, f64::min);
    let high = heights.fold(f64::NEG_INFINITY, f64::max);
    let (bottom, top) = (low + 0.1 * (high - low), high - 0.1 * (high - low));
    let sandbox = Sandbox::new();
    sandbox.write(
        "h.json",
        format!(
            r#"{{"handles": [
                {{"vertices": {{"box": {{"min": [-9, -9, -9], "max": [9, {bottom}, 9]}}}},
                  "fixed": true}},
                {{"vertices": {{"box": {{"min": [-9, {top}, -9], "max": [9, 9, 9]}}}},
                  "transform": {{"translate": [0, 0.25, 0]}}}}]}}"#
        ),
    );
    sandbox.cotan_ok(&format!(
        "deform {} --handles h.json -o o.glb --iterations 5",
        path.display()
    ));
    let after = cotan_io::load(sandbox.path("o.glb")).unwrap();
    let moved = before.positions().iter().zip(after.positions());
    for (before, after) in moved {
        if before.y <= bottom {
            assert_eq!(before, after);
        } else if before.y >= top {
            let target = before + Vector3::new(0.0, 0.25, 0.0);
            assert!((after - target).norm() < 1e-6, "{before} {after}");
        }
    }
    assert_eq!(before.faces(), after.faces());
    let (surface, old) = (after.surface().unwrap(), before.surface().unwrap());
    assert_eq!(surface.mesh().num_vertices(), old.mesh().num_vertices());
    assert!(after.inspect(Weld::AsFormat).unwrap().is_closed());
    let uv = |document: &cotan_io::Document| {
        let attributes = document.attributes().unwrap();
        let of_vertices = attributes.vertices.iter().find(|p| p.name == UV).cloned();
        let of_corners = attributes.corners.iter().find(|p| p.name == UV).cloned();
        (of_vertices, of_corners)
    };
    let (old, new) = (uv(&before), uv(&after));
    assert!(old.0.is_some() || old.1.is_some());
    assert!(old == new);
    let (old, old_images) = parts_of_glb(&std::fs::read(&path).unwrap());
    let (new, new_images) = parts_of_glb(&sandbox.read("o.glb"));
    for what in [
        "materials",
        "images",
        "textures",
        "samplers",
        "nodes",
        "scenes",
        "meshes",
    ] {
        assert_eq!(old[what], new[what], "{what}");
    }
    assert!(old_images == new_images && !old_images.is_empty());
}
