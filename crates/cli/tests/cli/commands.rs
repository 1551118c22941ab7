//! The other commands, usage errors, and exit codes.

use crate::sandbox::{Sandbox, json_handles};

#[test]
fn wrong_usage_is_exit_code_2_and_help_is_0() {
    let sandbox = Sandbox::with_bar();
    for line in [
        "",
        "bend bar.obj",
        "deform bar.obj",
        "deform bar.obj --handles h -o o.obj --scheme harmonic",
        "deform bar.obj --handles h -o o.obj --orientation up",
        "deform bar.obj --handles h -o o.obj --hard --soft 3",
        "deform bar.obj --handles h -o o.obj --soft -3",
        "deform bar.obj --handles h -o o.obj --soft NaN",
        "deform bar.obj --handles h -o o.obj --iterations 0",
        "deform bar.obj --handles h -o o.obj --tolerance -1",
        "deform bar.obj --handles h -o o.obj --threads 0",
        "deform bar.obj --handles h -o o.obj --accelerate much",
        "deform bar.obj --handles h -o o.obj --history",
        "deform bar.obj --handles h -o o.obj --quiet -v",
        "reconstruct bar.obj --handles h -o o.obj",
        "info",
    ] {
        let outcome = sandbox.cotan(line);
        assert_eq!(outcome.code, 2, "cotan {line}: {outcome:?}");
        assert_eq!(outcome.stdout, "", "cotan {line}");
    }
    let scheme = sandbox
        .cotan("deform bar.obj --handles h -o o.obj --scheme harmonic")
        .stderr;
    assert!(
        scheme.contains("tutte") && scheme.contains("edge-length"),
        "{scheme}"
    );
    for line in ["--help", "--version", "deform --help", "completions --help"] {
        assert!(!sandbox.cotan_ok(line).stdout.is_empty());
    }
}

#[test]
fn info_prints_counts_and_topology() {
    let sandbox = Sandbox::with_bar();
    let text = sandbox.cotan_ok("info bar.obj").stdout;
    assert!(text.contains("genus                   0\n"), "{text}");
    let json = sandbox.cotan_ok("info bar.obj --json").stdout;
    let info: serde_json::Value = serde_json::from_str(&json).unwrap();
    let shape = crate::sandbox::bar();
    assert_eq!(info["vertices"], shape.num_vertices());
    assert_eq!(info["edges"], shape.connectivity().num_edges());
    assert_eq!(info["closed"], true);
    assert_eq!(
        (&info["boundary_loops"], &info["components"]),
        (&0.into(), &1.into())
    );
    assert!((info["volume"].as_f64().unwrap() - 6.0).abs() < 1e-9);
    assert!((info["area"].as_f64().unwrap() - 26.0).abs() < 1e-9);
}

#[test]
fn info_describes_meshes_without_a_surface() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "fin.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 -1\nf 1 2 3\nf 2 1 4\nf 1 2 5\n",
    );
    let text = sandbox.cotan_ok("info fin.obj").stdout;
    assert!(text.contains("manifold                no"), "{text}");
    assert!(
        text.contains("between vertices 0 and 1 has 3 faces"),
        "{text}"
    );
    let json = sandbox.cotan_ok("info fin.obj --json").stdout;
    let info: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(info["defects"][0]["kind"], "non-manifold edge");
    assert_eq!(info["genus"], serde_json::Value::Null);

    sandbox.write("points.obj", "v 0 0 0\nv 1 0 0\n");
    let text = sandbox.cotan_ok("info points.obj").stdout;
    assert!(text.contains("no faces"), "{text}");
}

#[test]
fn a_mesh_does_not_differ_from_itself() {
    let sandbox = Sandbox::with_bar();
    let json = sandbox.cotan_ok("compare bar.obj bar.obj --json").stdout;
    let comparison: serde_json::Value = serde_json::from_str(&json).unwrap();
    for field in [
        "parameterization_error",
        "geometry_error",
        "edge_distortion_rms",
        "area_distortion_rms",
        "max_displacement",
    ] {
        assert_eq!(comparison[field], 0.0, "{field}");
    }
    assert_eq!(comparison["volume_ratio"], 1.0);
    assert_eq!(comparison["flipped_faces"], 0);
    assert!(comparison["arap_energy"].as_f64().unwrap().abs() < 1e-12);
    assert!(
        sandbox
            .cotan_ok("compare bar.obj bar.obj")
            .stdout
            .contains("E_p")
    );
}

#[test]
fn compare_agrees_with_the_report() {
    let sandbox = Sandbox::with_bar();
    sandbox.write("h.json", json_handles());
    sandbox.cotan_ok("deform bar.obj --handles h.json -o bent.ply --report r.json");
    let json = sandbox.cotan_ok("compare bar.obj bent.ply --json").stdout;
    let comparison: serde_json::Value = serde_json::from_str(&json).unwrap();
    let report = sandbox.json("r.json");
    for field in [
        "parameterization_error",
        "geometry_error",
        "volume_ratio",
        "folded_edges",
        "self_intersecting_faces",
        "max_dihedral_change_degrees",
        "stretch",
        "compression",
        "arap_energy",
    ] {
        assert!(!comparison[field].is_null(), "{field}");
        assert_eq!(comparison[field], report[field], "{field}");
    }
    let number = |name: &str, part: &str| comparison[name][part].as_f64().unwrap();
    for name in ["stretch", "compression"] {
        assert!(number(name, "p99") > 1.0 && number(name, "max") >= number(name, "p99"));
    }
    assert!(comparison["arap_energy"].as_f64().unwrap() > 0.0);
    let text = sandbox.cotan_ok("compare bar.obj bent.ply").stdout;
    for row in [
        "intersecting faces      0",
        "dihedral change, max",
        "stretch σ1",
    ] {
        assert!(text.contains(row), "{text}");
    }
}

#[test]
fn compare_reports_the_distance_to_a_given_shape() {
    let sandbox = Sandbox::with_bar();
    sandbox.write("h.json", json_handles());
    sandbox.cotan_ok("deform bar.obj --handles h.json -o bent.ply");
    let compare = |line: &str| -> serde_json::Value {
        serde_json::from_str(&sandbox.cotan_ok(line).stdout).unwrap()
    };
    let to_original = compare("compare bar.obj bent.ply --json");
    let to_itself = compare("compare bar.obj bent.ply --distance-to bent.ply --json");
    assert_eq!(to_itself["distance_rms"], 0.0);
    assert_eq!(to_itself["distance_max"], 0.0);
    let named = compare("compare bar.obj bent.ply --distance-to bar.obj --json");
    assert_eq!(named, to_original);
    let number = |name: &str| to_original[name].as_f64().unwrap();
    let side = number("max_displacement") / number("distance_max");
    assert!((number("rms_displacement") / number("distance_rms") / side - 1.0).abs() < 1e-12);
    let text = sandbox
        .cotan_ok("compare bar.obj bent.ply --distance-to bent.ply")
        .stdout;
    assert!(
        text.contains("distance to SHAPE       rms 0, max 0"),
        "{text}"
    );

    sandbox.cotan_ok("compare bar.obj bent.ply --picture two.png");
    sandbox.cotan_ok("compare bar.obj bent.ply --distance-to bar.obj --picture three.png");
    let [two, three] = ["two.png", "three.png"].map(|name| sandbox.read(name));
    assert!(two.starts_with(b"\x89PNG") && three.starts_with(b"\x89PNG"));
    assert_ne!(two, three);

    sandbox.write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let refused = sandbox.cotan("compare bar.obj bent.ply --distance-to one.obj");
    assert_ne!(refused.code, 0);
    assert!(refused.stderr.contains("one.obj"), "{}", refused.stderr);
}

/// The compression of a collapsed face is infinite, which JSON cannot express.
#[test]
fn infinite_values_are_null_in_json() {
    let sandbox = Sandbox::new();
    let faces = "f 1 2 3\nf 2 1 4\n";
    sandbox.write(
        "a.obj",
        format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\n{faces}"),
    );
    sandbox.write(
        "b.obj",
        format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0.5 0 0\n{faces}"),
    );
    let json = sandbox.cotan_ok("compare a.obj b.obj --json").stdout;
    let comparison: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(comparison["compression"]["max"].is_null());
    assert_eq!(comparison["degenerate_faces"], 1);
}

#[test]
fn conversion_there_and_back_keeps_every_bit() {
    let sandbox = Sandbox::with_bar();
    for line in [
        "convert bar.obj a.ply",
        "convert a.ply b.off",
        "convert b.off c.obj",
    ] {
        let outcome = sandbox.cotan_ok(line);
        assert_eq!(outcome.stderr, "", "{line}");
    }
    assert_eq!(sandbox.read("bar.obj"), sandbox.read("c.obj"));
}

#[test]
fn conversion_warns_of_losses() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "uv.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n",
    );
    let outcome = sandbox.cotan_ok("convert uv.obj uv.off");
    assert!(
        outcome.stderr.starts_with("warning: uv.off: "),
        "{outcome:?}"
    );
    assert!(
        outcome.stderr.contains("the corner property uv"),
        "{outcome:?}"
    );
}

#[test]
fn completions_are_printed_for_every_shell() {
    let sandbox = Sandbox::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = sandbox.cotan_ok(&format!("completions {shell}")).stdout;
        assert!(script.contains("reconstruct"), "{shell}");
    }
}
