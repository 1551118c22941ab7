//! `cotan bench`.

use crate::sandbox::{Sandbox, bar};

#[test]
fn every_phase_is_measured() {
    let sandbox = Sandbox::with_bar();
    let json = sandbox
        .cotan_ok("bench bar.obj --rounds 2 --threads 1 --json")
        .stdout;
    let measured: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let shape = bar();
    assert_eq!(measured["vertices"], shape.num_vertices());
    assert_eq!(measured["faces"], shape.num_faces());
    assert_eq!(measured["threads"], 1);
    assert_eq!(measured["job"]["stop_reason"], "converged");
    let seconds = measured["seconds"].as_object().expect("an object");
    for phase in [
        "load",
        "build",
        "assemble",
        "factor",
        "add_handle",
        "solve",
        "iteration",
    ] {
        assert!(seconds[phase].as_f64() > Some(0.0), "{phase}: {json}");
    }
    let bytes = &measured["bytes"];
    assert_eq!(bytes["file"], sandbox.read("bar.obj").len());
    assert!(bytes["mesh"].as_u64() > Some(0) && bytes["factor"].as_u64() > Some(0));
}

#[test]
fn the_table_agrees_with_the_json_for_the_built_in_model() {
    let sandbox = Sandbox::new();
    let table = sandbox
        .cotan_ok("bench --rounds 1 --orientation rotation")
        .stdout;
    for row in [
        "the built-in model",
        "load the file",
        "order and factor",
        "iteration",
        "whole drag",
    ] {
        assert!(table.contains(row), "no {row} in: {table}");
    }
}

#[test]
fn meshes_that_cannot_be_edited_are_refused() {
    let sandbox = Sandbox::new();
    sandbox.refused("bench nothing.obj", &["nothing.obj"]);
    sandbox.write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    sandbox.refused("bench points.obj", &["points.obj"]);
    // The same triangle three times is not a surface.
    sandbox.write(
        "thrice.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 3\nf 1 2 3\n",
    );
    sandbox.refused("bench thrice.obj", &["thrice.obj"]);
    assert_eq!(sandbox.cotan("bench --rounds 0").code, 2);
}
