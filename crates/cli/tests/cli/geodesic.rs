//! `cotan geodesic`, and `cotan compare` of meshes of different connectivity.

use cotan::shapes::icosphere;
use cotan_io::Document;

use crate::sandbox::Sandbox;

/// Writes balls of two resolutions.
fn balls() -> Sandbox {
    let sandbox = Sandbox::new();
    for (name, level) in [("coarse.obj", 3), ("fine.ply", 4)] {
        let ball = icosphere::<f64>(level);
        let document = Document::from_mesh(ball.connectivity(), ball.positions());
        cotan_io::save(&document.expect("a document"), sandbox.path(name)).expect("a file");
    }
    sandbox
}

#[test]
fn distances_are_a_property_and_agree_with_the_great_circle() {
    let sandbox = balls();
    sandbox.cotan_ok("geodesic fine.ply --from 7 -o d.ply --report r.json --picture p.png");
    let document = cotan_io::load(sandbox.path("d.ply")).expect("a mesh");
    let attributes = document.attributes().expect("attributes");
    let distances = attributes.vertex("distance").expect("distances");
    let source = document.positions()[7].coords;
    let mut squares = 0.0;
    for (v, p) in document.positions().iter().enumerate() {
        let distance = distances.values.get(v).expect("a number");
        squares += (distance - p.coords.angle(&source)).powi(2);
    }
    assert!((squares / document.positions().len() as f64).sqrt() < 0.02);
    assert_eq!(distances.values.get(7), Some(0.0));
    let report = sandbox.json("r.json");
    assert_eq!(
        (&report["sources"], &report["unreached_vertices"]),
        (&1.into(), &0.into())
    );
    let farthest = report["greatest_distance"].as_f64();
    assert!(farthest.is_some_and(|d| (d - std::f64::consts::PI).abs() < 0.05));
    assert!(sandbox.read("p.png").starts_with(b"\x89PNG"));
}

#[test]
fn points_are_sources_and_threads_change_nothing() {
    let sandbox = balls();
    for threads in [1, 3] {
        sandbox.cotan_ok(&format!(
            "geodesic coarse.obj --at -2,0.1,0.2 --at 2,0,0 --from 3,4 -o d{threads}.ply --threads {threads}"
        ));
    }
    assert_eq!(sandbox.read("d1.ply"), sandbox.read("d3.ply"));
}

#[test]
fn a_source_that_is_no_vertex_is_named() {
    let sandbox = balls();
    sandbox.refused(
        "geodesic coarse.obj --from 9999 -o d.ply",
        &["9999", "0 to 641"],
    );
    let outcome = sandbox.cotan("geodesic coarse.obj -o d.ply");
    assert_eq!(outcome.code, 2, "{outcome:?}");
    let outcome = sandbox.cotan("geodesic coarse.obj --at 1,2 -o d.ply");
    assert_eq!(outcome.code, 2, "{outcome:?}");
}

#[test]
fn meshes_of_different_connectivity_are_compared_by_their_surfaces() {
    let sandbox = balls();
    let outcome = sandbox.cotan_ok("compare coarse.obj fine.ply --json --picture p.png");
    let found: serde_json::Value = serde_json::from_str(&outcome.stdout).expect("JSON");
    assert_eq!(found["connectivity"], "different");
    let number = |path: &str| found.pointer(path).and_then(serde_json::Value::as_f64);
    // The middle of a coarse triangle is this far below the fine ball, about h² / 8.
    let hausdorff = number("/hausdorff").expect("a distance");
    assert!((0.001..0.01).contains(&hausdorff), "{found}");
    assert!(number("/hausdorff_bound").is_some_and(|b| b >= hausdorff && b < hausdorff + 0.001));
    assert!(number("/a_to_b/mean").is_some_and(|m| m > 0.0 && m < hausdorff));
    assert!(sandbox.read("p.png").starts_with(b"\x89PNG"));
    let text = sandbox.cotan_ok("compare coarse.obj fine.ply").stdout;
    assert!(
        text.contains("different") && text.contains("Hausdorff"),
        "{text}"
    );
    let same = sandbox.cotan_ok("compare fine.ply fine.ply").stdout;
    assert!(same.contains("vertex by vertex"), "{same}");
    sandbox.refused(
        "compare coarse.obj fine.ply --distance-to fine.ply",
        &["cannot be compared"],
    );
}
