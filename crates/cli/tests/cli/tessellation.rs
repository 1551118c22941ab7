//! `cotan decimate` with attributes that count.

use cotan::nalgebra::Point3;
use cotan::shapes::bumpy_plane;
use cotan_io::{Attributes, COLOR, Document, Property, Values};

use crate::sandbox::Sandbox;

/// A flat square, black on the left of x = 0 and white on the right.
fn painted() -> Sandbox {
    let plane = bumpy_plane::<f64>([1.0, 1.0], [20, 20], 0.0);
    let color = |p: &Point3<f64>| [if p.x > 0.0 { 255 } else { 0 }; 3];
    let colors = plane.positions().values().flat_map(color).collect();
    let attributes = Attributes {
        vertices: vec![Property {
            name: COLOR.to_owned(),
            components: 3,
            values: Values::U8(colors),
        }],
        ..Attributes::default()
    };
    let document = Document::from_mesh(plane.connectivity(), plane.positions())
        .and_then(|document| document.with_attributes(attributes));
    let sandbox = Sandbox::new();
    cotan_io::save(&document.expect("a document"), sandbox.path("painted.ply")).expect("a file");
    sandbox
}

/// The area on which the colours of a file differ from the painted ones, at the middles of its
/// faces.
fn wrong_area(sandbox: &Sandbox, name: &str) -> f64 {
    let document = cotan_io::load(sandbox.path(name)).expect("a mesh");
    let attributes = document.attributes().expect("attributes");
    let color = attributes.vertex(COLOR).expect("colours");
    let mut wrong = 0.0;
    for face in document.faces().iter() {
        let corners = [0, 1, 2].map(|k| face[k] as usize);
        let [a, b, c] = corners.map(|v| document.positions()[v]);
        let value = |v: usize| color.values.get(v * color.components).unwrap_or(0.0) / 255.0;
        let mean = corners.into_iter().map(value).sum::<f64>() / 3.0;
        let expected = if a.x + b.x + c.x > 0.0 { 1.0 } else { 0.0 };
        wrong += (b - a).cross(&(c - a)).norm() / 2.0 * (mean - expected).abs();
    }
    wrong
}

#[test]
fn colors_that_count_are_kept() {
    let sandbox = painted();
    sandbox.cotan_ok("decimate painted.ply -o plain.ply --faces 60");
    sandbox.cotan_ok("decimate painted.ply -o kept.ply --faces 60 --color-weight 1");
    let [plain, kept] = ["plain.ply", "kept.ply"].map(|name| wrong_area(&sandbox, name));
    assert!(kept < 0.04 && kept < 0.5 * plain, "{kept} of {plain}");
}

#[test]
fn a_property_that_is_missing_is_named_with_its_option() {
    let sandbox = painted();
    sandbox.refused(
        "decimate painted.ply -o out.ply --faces 60 --uv-weight 1",
        &["painted.ply", "\"uv\"", "--uv-weight"],
    );
}
