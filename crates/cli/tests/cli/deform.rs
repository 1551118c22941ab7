//! `cotan deform` and `cotan reconstruct`.

use crate::sandbox::{
    Sandbox, bar, def_matrix, ends, image, json_handles, numbers, sel_handles, text_handles,
};

fn with_handles() -> Sandbox {
    let sandbox = Sandbox::with_bar();
    sandbox.write("bar.json", json_handles());
    sandbox
}

#[test]
fn handles_meet_their_targets_and_the_rest_follows() {
    let sandbox = with_handles();
    sandbox.cotan_ok("deform bar.obj --handles bar.json -o bent.obj");
    let (shape, bent) = (bar(), sandbox.positions("bent.obj"));
    let [left, right] = ends();
    for v in left {
        assert_eq!(bent[v.index()], shape.positions()[v]);
    }
    for v in right {
        assert_eq!(bent[v.index()], image(shape.positions()[v]));
    }
    let middle = shape.surface().vertices_where(|p| p.x.abs() < 0.1);
    assert!(!middle.is_empty());
    assert!(
        middle
            .iter()
            .all(|&v| bent[v.index()].z - shape.positions()[v].z > 0.3)
    );
}

#[test]
fn the_strategy_is_chosen_reported_and_limited() {
    let sandbox = with_handles();
    let mut ends = Vec::new();
    for strategy in ["normal", "columns", "auto"] {
        sandbox.cotan_ok(&format!(
            "deform bar.obj --handles bar.json -o {strategy}.obj --strategy {strategy} --report r.json"
        ));
        let report = sandbox.json("r.json");
        assert!(strategy == "auto" || report["strategy"] == strategy);
        ends.push(sandbox.positions(&format!("{strategy}.obj")));
    }
    let apart = ends[0].iter().zip(&ends[1]).map(|(a, b)| (a - b).norm());
    assert!(apart.fold(0.0, f64::max) < 1e-6);
    assert!(ends[2] == ends[0] || ends[2] == ends[1]);
    sandbox.refused(
        "deform bar.obj --handles bar.json -o no.obj --max-memory 10K",
        &["bar.obj: more than 10000 bytes of memory"],
    );
}

#[test]
fn all_kinds_of_handles_files_give_the_same_result() {
    let sandbox = with_handles();
    sandbox.write("bar.txt", text_handles());
    sandbox.write("bar.sel", sel_handles());
    sandbox.write("bar.def", def_matrix());
    sandbox.write("other.def", def_matrix());
    sandbox.write("statuses", sel_handles());
    sandbox.write("no-extension", json_handles());
    sandbox.cotan_ok("deform bar.obj --handles bar.json -o json.obj");
    let others = [
        "bar.txt",
        "bar.sel",
        "no-extension",
        "statuses --def other.def",
        "bar.sel --def other.def",
    ];
    for handles in others {
        sandbox.cotan_ok(&format!("deform bar.obj --handles {handles} -o other.obj"));
        assert_eq!(
            sandbox.read("json.obj"),
            sandbox.read("other.obj"),
            "{handles}"
        );
    }
}

#[test]
fn regions_and_transforms_have_their_documented_effect() {
    let sandbox = with_handles();
    sandbox.write(
        "regions.json",
        r#"{"handles": [
            {"vertices": {"box": {"min": [-4, -1, -1], "max": [-2.999, 1, 1]}}, "fixed": true},
            {"vertices": {"box": {"min": [2.999, -1, -1], "max": [4, 1, 1]}},
             "transform": {"rotate": {"axis": [2, 0, 0], "degrees": 90}, "translate": [0, 0, 2]}}]}"#,
    );
    sandbox.cotan_ok("deform bar.obj --handles bar.json -o numbers.obj");
    sandbox.cotan_ok("deform bar.obj --handles regions.json -o regions.obj");
    let (a, b) = (
        sandbox.positions("numbers.obj"),
        sandbox.positions("regions.obj"),
    );
    let far = a
        .iter()
        .zip(&b)
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max);
    assert!(far < 1e-6, "{far}");
}

#[test]
fn the_report_has_the_documented_fields() {
    let sandbox = with_handles();
    sandbox.cotan_ok("deform bar.obj --handles bar.json -o bent.obj --report r.json --history");
    let report = sandbox.json("r.json");
    let shape = bar();
    assert_eq!(report["vertices"], shape.num_vertices());
    assert_eq!(report["faces"], shape.num_faces());
    assert_eq!(report["handles"], ends().concat().len());
    assert_eq!(report["stop_reason"], "converged");
    assert_eq!(report["converged"], true);
    assert_eq!(report["flipped_faces"], 0);
    assert_eq!(report["scheme"], "cotangent");
    assert_eq!(report["orientation"], "hybrid");
    assert!(report["max_relative_change"].as_f64().unwrap() <= 1e-4);
    let numbers = [
        "parameterization_error",
        "geometry_error",
        "edge_distortion_rms",
        "volume_ratio",
        "residual",
    ];
    for field in numbers {
        assert!(report[field].as_f64().unwrap() > 0.0, "{field}: {report}");
    }
    for phase in ["load", "build", "factor", "iterate", "total"] {
        assert!(
            report["seconds"][phase].as_f64().unwrap() > 0.0,
            "{phase}: {report}"
        );
    }
    let history = report["history"].as_array().unwrap();
    assert_eq!(report["iterations"], history.len());
    let last = history.last().unwrap();
    assert_eq!(last["iteration"], history.len());
    for field in ["parameterization_error", "geometry_error"] {
        let (last, whole) = (
            last[field].as_f64().unwrap(),
            report[field].as_f64().unwrap(),
        );
        assert!(
            (last - whole).abs() < 1e-9 * whole.abs(),
            "{field}: {last} {whole}"
        );
    }
    assert_eq!(last["change"], report["max_relative_change"]);

    sandbox.cotan_ok("deform bar.obj --handles bar.json -o bent.obj --report r.json");
    assert!(sandbox.json("r.json").get("history").is_none());
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let sandbox = with_handles();
    for threads in [1, 2, 3] {
        sandbox.cotan_ok(&format!(
            "deform bar.obj --handles bar.json -o {threads}.ply --picture {threads}.png \
             --threads {threads} --rescale"
        ));
    }
    for other in [2, 3] {
        assert_eq!(sandbox.read("1.ply"), sandbox.read(&format!("{other}.ply")));
        assert_eq!(sandbox.read("1.png"), sandbox.read(&format!("{other}.png")));
    }
}

#[test]
fn single_precision_is_close_to_double_precision() {
    let sandbox = with_handles();
    for precision in ["f32", "f64"] {
        sandbox.cotan_ok(&format!(
            "deform bar.obj --handles bar.json -o {precision}.obj --precision {precision}"
        ));
    }
    let (a, b) = (sandbox.positions("f32.obj"), sandbox.positions("f64.obj"));
    let far = a
        .iter()
        .zip(&b)
        .map(|(a, b)| (a - b).norm())
        .fold(0.0, f64::max);
    assert!(far < 5e-3, "{far}");
    assert_ne!(a, b);
}

#[test]
fn every_scheme_and_orientation_runs() {
    let sandbox = with_handles();
    let settings = [
        "--scheme tutte",
        "--scheme uniform",
        "--scheme edge-length",
        "--scheme clamped",
        "--orientation rotation --accelerate 5",
        "--orientation limited",
        "--orientation limited-magnitude",
        "--orientation reflect --start original --accelerate off --schedule paper --iterations 20",
        "--start zero --tolerance 1e-3",
        "--bending-length 0.05 --hard",
    ];
    for setting in settings {
        let line =
            format!("deform bar.obj --handles bar.json -o out.off --report r.json {setting}");
        sandbox.cotan_ok(&line);
        assert!(
            sandbox.json("r.json")["geometry_error"].is_number(),
            "{setting}"
        );
    }
}

#[test]
fn soft_handles_give_way_unless_they_have_a_weight_of_their_own() {
    let sandbox = with_handles();
    let [left, right] = ends().map(|end| numbers(&end));
    let moved = |weight: &str| {
        format!(
            r#"{{"handles": [{{"vertices": {left:?}, "fixed": true}}, {{"vertices": {right:?},
                "transform": {{"translate": [0, 0, 2]}}{weight}}}]}}"#
        )
    };
    sandbox.write("plain.json", moved(""));
    sandbox.write("weak.json", moved(r#", "weight": 0.001"#));
    let miss = |line: &str| {
        sandbox.cotan_ok(&format!("deform bar.obj -o out.obj {line}"));
        let out = sandbox.positions("out.obj");
        let shape = bar();
        let miss = |v: &usize| {
            let target = shape.positions()[cotan::halfedge::VertexId::new(*v)].z + 2.0;
            (out[*v].z - target).abs()
        };
        right.iter().map(miss).fold(0.0, f64::max)
    };
    assert_eq!(miss("--handles plain.json"), 0.0);
    let (soft, stiff) = (
        miss("--handles plain.json --soft 0.01"),
        miss("--handles plain.json --soft 1000"),
    );
    assert!(soft > 10.0 * stiff && stiff > 0.0, "{soft} {stiff}");
    let weak = miss("--handles weak.json --soft 1000");
    assert!(weak > 10.0 * stiff, "{weak} {stiff}");
}

#[test]
fn stopping_at_the_limit_is_a_warning() {
    let sandbox = with_handles();
    let line = "deform bar.obj --handles bar.json -o bent.obj --iterations 1 --report r.json";
    let outcome = sandbox.cotan_ok(line);
    assert!(
        outcome
            .stderr
            .starts_with("warning: not converged after 1 iteration ("),
        "{outcome:?}"
    );
    let report = sandbox.json("r.json");
    assert_eq!(report["stop_reason"], "iteration limit");
    assert_eq!(report["converged"], false);
    let quiet = sandbox.cotan_ok(&format!("--quiet {line}"));
    assert_eq!(quiet.stderr, "");
}

#[test]
fn nothing_is_printed_to_a_pipe() {
    let sandbox = with_handles();
    let outcome = sandbox.cotan_ok("deform bar.obj --handles bar.json -o bent.obj");
    assert_eq!((outcome.stdout.as_str(), outcome.stderr.as_str()), ("", ""));
    let outcome = sandbox.cotan_ok("deform bar.obj --handles bar.json -o bent.obj -v");
    assert!(outcome.stderr.contains("E_p"), "{outcome:?}");
    assert_eq!(outcome.stdout, "");
}

#[test]
fn everything_but_the_positions_is_kept() {
    let sandbox = Sandbox::new();
    // Vertex 1 belongs to no face. Indices count from vertex 0 of the file all the same.
    sandbox.write(
        "quad.obj",
        "# a tent\nv 0 0 0\nv 9 9 9 # alone\nv 1.50 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 0.25\nvt 0 1\n\
         f 1/1 3/1 6/1\nf 3/1 4/1 6/1\nf 4/1 5/1 6/1\nf 5/1 1/1 6/1\n",
    );
    sandbox.write(
        "top.txt",
        "5 0.5 0.5 1\n0 0 0 0\n2 1.5 0 0\n3 1 1 0\n4 0 1 0\n",
    );
    sandbox.cotan_ok("deform quad.obj --handles top.txt -o out.obj");
    let (before, after) = (sandbox.read("quad.obj"), sandbox.read("out.obj"));
    let expected = String::from_utf8(before)
        .unwrap()
        .replace("v 0.5 0.5 0.25", "v 0.5 0.5 1");
    assert_eq!(String::from_utf8(after).unwrap(), expected);
}

#[test]
fn open_meshes_have_no_volume_ratio() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "tri.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.2\nf 1 2 3\nf 3 2 4\n",
    );
    sandbox.write("h.txt", "0 0 0 0\n1 1 0 0\n2 0 1 0\n");
    sandbox.cotan_ok("deform tri.obj --handles h.txt -o o.obj --report r.json");
    assert!(sandbox.json("r.json")["volume_ratio"].is_null());
}

#[test]
fn reconstruct_is_the_librarys_reconstruction() {
    use cotan::prelude::*;
    let sandbox = Sandbox::with_bar();
    let shape = bar();
    let pins: Vec<VertexId> = shape
        .connectivity()
        .vertices()
        .step_by(60)
        .take(5)
        .collect();
    let lines = pins.iter().map(|&v| (v.index(), shape.positions()[v]));
    let text: String = lines
        .map(|(v, p)| format!("{v} {} {} {}\n", p.x, p.y, p.z))
        .collect();
    sandbox.write("pins.txt", text);
    let outcome = sandbox.cotan_ok(
        "reconstruct bar.obj --handles pins.txt --iterations 30 -o rebuilt.obj --report r.json",
    );
    assert_eq!(sandbox.json("r.json")["iterations"], 30);
    assert!(!outcome.stderr.contains("not converged"), "{outcome:?}");

    let handles = Handles::new().fix(pins);
    let options = DeformOptions::default().iteration_limit(30).tolerance(0.0);
    let expected = reconstruct(shape.surface(), &handles, &options).unwrap();
    let rebuilt = sandbox.positions("rebuilt.obj");
    assert_eq!(expected.positions.as_slice(), rebuilt);
}

#[test]
fn only_the_region_moves() {
    let sandbox = with_handles();
    let shape = bar();
    let [_, right] = ends();
    for falloff in ["", "--falloff 0.5"] {
        sandbox.cotan_ok(&format!(
            "deform bar.obj --handles bar.json -o part.obj --region box:0,-9,-9,9,9,9 {falloff}"
        ));
        let part = sandbox.positions("part.obj");
        let mut moved = 0;
        for (v, p) in shape.positions().iter() {
            let now = part[v.index()];
            if p.x < 0.0 {
                assert_eq!(now, *p);
            } else if (now - p).norm() > 0.1 {
                moved += 1;
            }
        }
        assert!(moved > 50, "{moved}");
        for &v in &right {
            assert_eq!(part[v.index()], image(shape.positions()[v]));
        }
    }
    sandbox.refused(
        "deform bar.obj --handles bar.json -o no.obj --region sphere:99,0,0,1",
        &["no vertex"],
    );
}
