//! `cotan sphere`.

use cotan::Mesh;
use cotan::geometry::Surface;
use cotan::shapes;
use cotan::sphere::{SphereMap, SphereOptions, SphereQuality, flipped_faces, spherical};
use cotan_io::{Document, FaceList};
use nalgebra::Point3;

use crate::sandbox::Sandbox;
use crate::shared::mesh;

/// A sandbox with a small model that has limbs.
pub(crate) fn with_creature() -> Sandbox {
    let sandbox = Sandbox::new();
    save(&sandbox, "creature.obj", &creature());
    sandbox
}

pub(crate) fn creature() -> Mesh<f64> {
    shapes::creature(32)
}

pub(crate) fn save(sandbox: &Sandbox, name: &str, shape: &Mesh<f64>) {
    let document =
        Document::from_mesh(shape.connectivity(), shape.positions()).expect("a document");
    cotan_io::save(&document, sandbox.path(name)).expect("a mesh file");
}

/// Writes a distorted icosphere without some of its faces.
pub(crate) fn save_without(sandbox: &Sandbox, name: &str, missing: &[usize]) {
    let shape = shapes::icosphere::<f64>(2);
    let positions = shape.positions().values();
    let positions = positions.map(|p| Point3::new(3.0 * p.x, p.y + 0.2 * p.x * p.x, p.z));
    let faces = shape
        .connectivity()
        .faces()
        .filter(|f| !missing.contains(&f.index()));
    let list: FaceList = faces
        .map(|face| {
            shape
                .connectivity()
                .triangle(face)
                .map(|v| v.index() as u32)
                .to_vec()
        })
        .collect();
    let document = Document::new(positions.collect(), list).expect("a document");
    cotan_io::save(&document, sandbox.path(name)).expect("a mesh file");
}

#[test]
fn every_vertex_is_on_the_unit_sphere_where_the_library_puts_it() {
    let sandbox = with_creature();
    let outcome = sandbox.cotan_ok("sphere creature.obj -o sphere.obj");
    assert_eq!((outcome.stdout.as_str(), outcome.stderr.as_str()), ("", ""));
    let shape = creature();
    let expected = spherical(shape.surface(), &SphereOptions::default())
        .expect("a map")
        .map;
    let positions = sandbox.positions("sphere.obj");
    assert_eq!(positions, expected.positions().as_slice());
    // Check again as read from the file.
    assert!(SphereMap::new(shape.connectivity(), positions.into_iter().collect()).is_ok());
}

#[test]
fn the_report_has_the_documented_fields_and_agrees_with_the_library() {
    let sandbox = with_creature();
    sandbox.cotan_ok("sphere creature.obj -o sphere.obj --report r.json");
    let report = sandbox.json("r.json");
    let shape = creature();
    assert_eq!(report["vertices"], shape.num_vertices());
    assert_eq!(report["faces"], shape.num_faces());
    assert_eq!(report["stop_reason"], "converged");
    assert_eq!(report["converged"], true);
    assert_eq!(report["flipped_triangles"], 0);
    assert_eq!(report["degree"], 1);
    assert_eq!(report["method"], "robust");
    assert_eq!(report["scheme"], "cotangent");
    assert_eq!(report["authalic"], 0.0);
    assert_eq!(report["precision"], "f64");
    assert!(report["iterations"].as_u64().unwrap() > 0);
    assert!(report["sphericity_error"].as_f64().unwrap() < 1e-12);
    assert!(report["seconds"].as_f64().unwrap() > 0.0);
    for phase in ["load", "build", "map"] {
        assert!(report["phases"][phase].as_f64().unwrap() > 0.0, "{report}");
    }
    assert!(!report["stages"].as_array().unwrap().is_empty());
    let done = spherical(shape.surface(), &SphereOptions::default()).unwrap();
    let surface = Surface::new(shape.connectivity(), shape.positions()).unwrap();
    let quality = SphereQuality::measure(&surface, &done.map);
    // A JSON reader may lose the last bit.
    let same = |field: &str, part: &str, value: f64| {
        let told = report[field][part].as_f64().unwrap();
        assert!(
            (told - value).abs() <= 1e-14 * value.abs(),
            "{field} {part}: {told} {value}"
        );
    };
    for (field, spread) in [
        ("conformal_distortion", quality.conformal_distortion),
        ("area_distortion", quality.area_distortion),
    ] {
        same(field, "mean", spread.mean);
        same(field, "p99", spread.p99);
        same(field, "max", spread.max);
    }
    same(
        "angle_error_degrees",
        "mean",
        quality.angle_error_degrees.mean,
    );
    same(
        "angle_error_degrees",
        "max",
        quality.angle_error_degrees.max,
    );
}

#[test]
fn the_slider_trades_angles_for_areas() {
    let sandbox = with_creature();
    let measure = |setting: &str| {
        sandbox.cotan_ok(&format!(
            "sphere creature.obj -o s.obj --report r.json {setting}"
        ));
        let report = sandbox.json("r.json");
        assert_eq!(report["flipped_triangles"], 0, "{setting}");
        let mean = |field: &str| report[field]["mean"].as_f64().unwrap();
        [mean("conformal_distortion"), mean("area_distortion")]
    };
    let conformal = measure("--conformal");
    let authalic = measure("--authalic 1");
    assert!(authalic[0] > conformal[0], "{conformal:?} {authalic:?}");
    assert!(
        authalic[1] < conformal[1] / 3.0,
        "{conformal:?} {authalic:?}"
    );
}

#[test]
fn the_picture_is_a_png_and_does_not_depend_on_the_number_of_threads() {
    let sandbox = with_creature();
    for threads in [1, 2, 3] {
        sandbox.cotan_ok(&format!(
            "sphere creature.obj -o {threads}.ply --picture {threads}.png --threads {threads} \
             --geometry-image g{threads}.png --uv --orient principal"
        ));
    }
    let picture = sandbox.read("1.png");
    assert!(picture.starts_with(b"\x89PNG"));
    assert!(sandbox.read("g1.png").starts_with(b"\x89PNG"));
    for other in [2, 3] {
        assert_eq!(sandbox.read("1.ply"), sandbox.read(&format!("{other}.ply")));
        assert_eq!(picture, sandbox.read(&format!("{other}.png")));
        assert_eq!(
            sandbox.read("g1.png"),
            sandbox.read(&format!("g{other}.png"))
        );
    }
}

#[test]
fn single_precision_has_no_flip_either_also_far_from_the_origin() {
    let sandbox = Sandbox::new();
    let shape = creature();
    let far = Mesh::new(
        shape.connectivity().clone(),
        shape.positions().map(|p| Point3::new(p.x + 1e6, p.y, p.z)),
    )
    .expect("a surface");
    save(&sandbox, "far.obj", &far);
    sandbox.cotan_ok("sphere far.obj -o s.obj --precision f32 --report r.json");
    let report = sandbox.json("r.json");
    assert_eq!(report["precision"], "f32");
    assert!(report["sphericity_error"].as_f64().unwrap() < 1e-6);
    assert!(report["conformal_distortion"]["mean"].as_f64().unwrap() < 1.5);
    let positions: cotan::geometry::Positions<f64> =
        sandbox.positions("s.obj").into_iter().collect();
    assert!(flipped_faces(shape.connectivity(), &positions).is_empty());
    assert!(positions.values().all(|p| p.x == f64::from(p.x as f32)));
}

#[test]
fn every_scheme_and_method_runs_and_is_named_in_the_report() {
    let sandbox = Sandbox::new();
    save_without(&sandbox, "egg.obj", &[]);
    for scheme in [
        "cotangent",
        "tutte",
        "uniform",
        "edge-length",
        "clamped",
        "intrinsic-delaunay",
    ] {
        sandbox.cotan_ok(&format!(
            "sphere egg.obj -o s.off --report r.json --scheme {scheme}"
        ));
        assert_eq!(sandbox.json("r.json")["scheme"], scheme);
    }
    for method in ["robust", "paper", "cmcf"] {
        sandbox.cotan_ok(&format!(
            "sphere egg.obj -o s.off --report r.json --method {method} --center off"
        ));
        let report = sandbox.json("r.json");
        assert_eq!(report["method"], method);
        assert_eq!(report["center"], "off");
        assert_eq!(report["flipped_triangles"], 0, "{method}");
    }
    let outcome = sandbox.cotan_ok("sphere egg.obj -o s.off --method cmcf --authalic 1");
    assert!(
        outcome
            .stderr
            .contains("--authalic is ignored, since it needs --method robust"),
        "{outcome:?}"
    );
}

#[test]
fn stopping_at_the_limit_is_a_warning() {
    let sandbox = Sandbox::new();
    save_without(&sandbox, "egg.obj", &[]);
    let line = "sphere egg.obj -o s.obj --iterations 2 --report r.json";
    let outcome = sandbox.cotan_ok(line);
    let said = "warning: not converged after 2 iterations (";
    assert!(outcome.stderr.starts_with(said), "{outcome:?}");
    let report = sandbox.json("r.json");
    assert_eq!(report["stop_reason"], "iteration limit");
    assert_eq!(report["converged"], false);
    assert_eq!(report["flipped_triangles"], 0);
    assert_eq!(sandbox.cotan_ok(&format!("--quiet {line}")).stderr, "");
}

#[test]
fn everything_but_the_positions_is_kept() {
    let sandbox = Sandbox::new();
    // A cube of quads around vertices 1 … 8; vertex 0 belongs to no face.
    let text = "# a cube\nv 9 9 9 # alone\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\n\
                v 1 1 1\nv 0 1 1\ng bottom\nf 5 4 3 2\nf 6 7 8 9\nf 2 3 7 6\nf 3 4 8 7\n\
                f 4 5 9 8\nf 5 2 6 9\n";
    sandbox.write("cube.obj", text);
    sandbox.cotan_ok("sphere cube.obj -o s.obj");
    let after = String::from_utf8(sandbox.read("s.obj")).unwrap();
    let lines = text.lines().zip(after.lines());
    assert_eq!(text.lines().count(), after.lines().count());
    for (number, (before, after)) in lines.enumerate() {
        // Vertex 0 is moved to the sphere too.
        let is_moved = (1..=9).contains(&number);
        assert_eq!(before != after, is_moved, "{before} | {after}");
    }
}

#[test]
fn holes_are_filled_on_request_and_refused_otherwise() {
    let sandbox = Sandbox::new();
    save_without(&sandbox, "open.obj", &[7, 100]);
    sandbox.refused(
        "sphere open.obj -o s.obj",
        &["open.obj", "not closed", "2 hole", "--fill-holes"],
    );
    assert!(!sandbox.path("s.obj").exists());
    let outcome = sandbox.cotan_ok("sphere open.obj -o s.obj --fill-holes --report r.json");
    assert!(outcome.stderr.contains("filled the hole"), "{outcome:?}");
    assert_eq!(sandbox.json("r.json")["faces"], 320);
    assert_eq!(sandbox.json("r.json")["flipped_triangles"], 0);
    let document = cotan_io::load(sandbox.path("s.obj")).unwrap();
    assert_eq!(document.faces().len(), 320);
    sandbox.refused(
        "sphere open.obj -o s.obj --fill-holes=2",
        &["2 hole", "larger =N"],
    );
}

#[test]
fn meshes_without_a_sphere_map_are_refused_with_indices_of_the_file() {
    let sandbox = Sandbox::new();
    let refused = |text: &str, words: &[&str]| {
        sandbox.write("m.obj", text);
        let words: Vec<&str> = ["m.obj"].iter().chain(words).copied().collect();
        sandbox.refused("sphere m.obj -o s.obj", &words);
        assert!(!sandbox.path("s.obj").exists());
    };
    let tetrahedron = |first: usize, x: usize| {
        let corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];
        let lines = corners.map(|[dx, y, z]| format!("v {} {y} {z}\n", x + dx));
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let faces = faces.map(|f| {
            let [a, b, c] = f.map(|v| v + first + 1);
            format!("f {a} {b} {c}\n")
        });
        format!("{}{}", lines.concat(), faces.concat())
    };
    // Vertex 0 of the file belongs to no face.
    let two = format!("v 9 9 9\n{}{}", tetrahedron(1, 0), tetrahedron(5, 3));
    refused(
        &two,
        &[
            "2 components",
            "4 vertices from vertex 1",
            "4 vertices from vertex 5",
        ],
    );
    let tent = format!("v 9 9 9\n{}", tetrahedron(1, 0));
    let tent = tent.rsplit_once("f ").unwrap().0;
    refused(tent, &["1 hole", "--fill-holes"]);
    refused(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\n",
        &["2 faces", "at least four"],
    );
    refused(
        "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n",
        &["line 2", "vertex 1"],
    );
    let bow_tie = format!(
        "{}v 2 2 2\nv 3 2 2\nv 2 3 2\nf 1 6 5\nf 1 7 6\nf 1 5 7\nf 5 6 7\n",
        tetrahedron(0, 0)
    );
    refused(
        &bow_tie,
        &["vertex 0", "fans", "--split-vertices", "--repair"],
    );
    let zero = "v 1 1 1\nv 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let outcome = {
        sandbox.write("m.obj", zero);
        sandbox.cotan("sphere m.obj -o s.obj")
    };
    // A tetrahedron without extent may be mapped or refused, but must not panic.
    assert!(
        outcome.code == 0 || outcome.stderr.starts_with("error: m.obj: "),
        "{outcome:?}"
    );

    let torus = shapes::torus::<f64>(2.0, 0.5, 12, 8);
    save(&sandbox, "torus.obj", &torus);
    sandbox.refused("sphere torus.obj -o s.obj", &["torus.obj", "genus 1"]);
}

#[test]
fn impossible_outputs_and_options_are_refused_before_the_work() {
    let sandbox = with_creature();
    let line = "sphere creature.obj";
    sandbox.refused(&format!("{line} -o s.xyz"), &["s.xyz", ".obj, .ply"]);
    for option in ["--report", "--picture", "--geometry-image"] {
        sandbox.refused(
            &format!("{line} -o s.obj {option} no/file"),
            &["no/file", "does not exist"],
        );
    }
    for option in [
        "--method harmonic",
        "--scheme harmonic",
        "--authalic 1.5",
        "--authalic NaN",
        "--conformal --authalic 1",
        "--center maybe",
        "--orient up",
        "--orient principal --landmarks l.txt",
        "--iterations 0",
        "--tolerance -1",
        "--fill-holes=0",
        "--size 64",
        "--size 1",
        "--precision f16",
    ] {
        let outcome = sandbox.cotan(&format!("{line} -o s.obj {option}"));
        assert_eq!(outcome.code, 2, "{option}: {outcome:?}");
    }
    assert!(!sandbox.path("s.obj").exists());
}

#[test]
fn hard_models_have_no_flip() {
    for name in ["brain.ply", "cartoon_elephant.obj", "spot.obj"] {
        let Some(path) = mesh(name) else { continue };
        let sandbox = Sandbox::new();
        sandbox.cotan_ok(&format!(
            "sphere {} -o s.ply --report r.json --picture p.png",
            path.display()
        ));
        let report = sandbox.json("r.json");
        assert_eq!(report["flipped_triangles"], 0, "{name}");
        assert_eq!(report["degree"], 1, "{name}");
        assert!(
            report["sphericity_error"].as_f64().unwrap() < 1e-12,
            "{name}"
        );
        assert!(sandbox.read("p.png").starts_with(b"\x89PNG"));
    }
}

#[test]
fn an_open_model_is_mapped_when_its_holes_are_filled() {
    let Some(path) = mesh("camelhead.off") else {
        return;
    };
    let sandbox = Sandbox::new();
    let path = path.display();
    sandbox.refused(
        &format!("sphere {path} -o s.off"),
        &["not closed", "vertex ", "--fill-holes"],
    );
    sandbox.cotan_ok(&format!(
        "sphere {path} -o s.off --fill-holes --report r.json"
    ));
    assert_eq!(sandbox.json("r.json")["flipped_triangles"], 0);
}

#[test]
fn flips_caused_by_rounding_in_the_file_are_reported() {
    let Some(path) = mesh("dinosaur.obj") else {
        return;
    };
    let sandbox = Sandbox::new();
    let path = path.display();
    let outcome = sandbox.cotan_ok(&format!("sphere {path} -o s.stl"));
    assert!(
        outcome.stderr.contains("shorter numbers of this file flip"),
        "{outcome:?}"
    );
    let outcome = sandbox.cotan_ok(&format!("sphere {path} -o s.stl --precision f32"));
    assert!(!outcome.stderr.contains("shorter numbers"), "{outcome:?}");
}
