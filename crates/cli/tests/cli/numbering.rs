//! Files with randomly ordered vertices are processed in another order, which does not show.

use cotan::Mesh;
use cotan::shapes::{VertexOrder, irregular};
use cotan_io::Document;
use nalgebra::Point3;

use crate::sandbox::Sandbox;
use crate::sphere_uses::check_texture;

/// A blob as `natural.obj` and, with vertices and faces in random order, as `random.obj`.
///
/// Also returns the index in the second file of each vertex of the first.
fn two_files() -> (Sandbox, Vec<usize>) {
    let sandbox = Sandbox::new();
    let shapes = [VertexOrder::Natural, VertexOrder::Random].map(|n| irregular::<f64>(4_500, n, 8));
    for (shape, name) in shapes.iter().zip(["natural.obj", "random.obj"]) {
        save(&sandbox, shape, name);
    }
    let sorted = |shape: &Mesh<f64>| {
        let key = |p: &Point3<f64>| [p.x, p.y, p.z];
        let mut order: Vec<usize> = (0..shape.positions().len()).collect();
        let points = shape.positions().as_slice();
        order.sort_by(|&a, &b| {
            key(&points[a])
                .partial_cmp(&key(&points[b]))
                .expect("numbers")
        });
        order
    };
    let [natural, random] = shapes.each_ref().map(sorted);
    let mut number = vec![0; natural.len()];
    for (a, b) in natural.into_iter().zip(random) {
        number[a] = b;
    }
    (sandbox, number)
}

fn save(sandbox: &Sandbox, shape: &Mesh<f64>, name: &str) {
    let document =
        Document::from_mesh(shape.connectivity(), shape.positions()).expect("a document");
    cotan_io::save(&document, sandbox.path(name)).expect("a mesh file");
}

/// Handles that refer to vertices by index: a fixed patch and a vertex that is pulled.
fn handles(positions: &[Point3<f64>], number: impl Fn(usize) -> usize) -> String {
    let vertices = 0..positions.len();
    let fixed: Vec<usize> = vertices
        .filter(|&v| positions[v].z < -0.7)
        .map(&number)
        .collect();
    let pulled = number(17);
    format!(
        r#"{{"handles": [{{"vertices": {fixed:?}, "fixed": true}},
            {{"vertices": [{pulled}], "transform": {{"translate": [0.2, 0.1, 0.3]}}}}]}}"#
    )
}

#[test]
fn a_shuffled_file_deforms_as_the_file_itself() {
    let (sandbox, number) = two_files();
    let positions = sandbox.positions("natural.obj");
    sandbox.write("natural.json", handles(&positions, |v| v));
    sandbox.write("random.json", handles(&positions, |v| number[v]));
    for name in ["natural", "random"] {
        sandbox.cotan_ok(&format!(
            "deform {name}.obj --handles {name}.json -o {name}-bent.obj --tolerance 1e-10 \
             --iterations 1000 --orientation rotation"
        ));
    }
    let [a, b] = ["natural-bent.obj", "random-bent.obj"].map(|name| sandbox.positions(name));
    let worst = (0..a.len())
        .map(|v| (a[v] - b[number[v]]).norm())
        .fold(0.0, f64::max);
    let moved = (0..a.len())
        .map(|v| (a[v] - positions[v]).norm())
        .fold(0.0, f64::max);
    assert!(worst < 1e-7 && moved > 0.3, "{worst} {moved}");
    // Faces and vertex order are those of the file.
    let faces = |name: &str| {
        cotan_io::load(sandbox.path(name))
            .expect("a mesh")
            .faces()
            .clone()
    };
    assert_eq!(faces("random.obj"), faces("random-bent.obj"));
    let quality = sandbox
        .cotan_ok("compare random.obj random-bent.obj --json")
        .stdout;
    let quality: serde_json::Value = serde_json::from_str(&quality).expect("JSON");
    let longest = quality["max_displacement"].as_f64().expect("a number");
    assert!((longest - moved).abs() < 1e-7);
}

#[test]
fn texture_coordinates_belong_to_their_corners() {
    let (sandbox, number) = two_files();
    for name in ["natural", "random"] {
        sandbox.cotan_ok(&format!(
            "sphere {name}.obj -o {name}-map.obj --uv --orient principal"
        ));
    }
    for name in ["natural-map.obj", "random-map.obj"] {
        check_texture(&cotan_io::load(sandbox.path(name)).expect("a mesh"));
    }
    let [a, b] = ["natural-map.obj", "random-map.obj"].map(|name| sandbox.positions(name));
    // Two maps of one shape agree as far as they have converged.
    let worst = (0..a.len())
        .map(|v| (a[v] - b[number[v]]).norm())
        .fold(0.0, f64::max);
    assert!(worst < 0.05, "{worst}");
}
