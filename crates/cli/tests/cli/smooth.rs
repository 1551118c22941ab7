//! `cotan smooth`, `cotan denoise` and `cotan detail`.

use cotan::shapes::icosphere;
use cotan::smooth::with_normal_noise;
use cotan_io::Document;

use crate::sandbox::Sandbox;

/// Writes a ball without and with noise.
fn balls() -> Sandbox {
    let sandbox = Sandbox::new();
    let ball = icosphere::<f64>(3);
    let noisy = with_normal_noise(&ball.surface(), 0.03, 5);
    for (name, positions) in [("ball.obj", ball.positions()), ("noisy.obj", &noisy)] {
        let document = Document::from_mesh(ball.connectivity(), positions).expect("a document");
        cotan_io::save(&document, sandbox.path(name)).expect("a file");
    }
    sandbox
}

#[test]
fn noise_is_reduced_and_the_report_measures_it() {
    let sandbox = balls();
    sandbox.cotan_ok(
        "denoise noisy.obj -o out.obj --truth ball.obj --preserve-volume --report r.json \
         --picture p.png",
    );
    let report = sandbox.json("r.json");
    let number = |path: &str| {
        report
            .pointer(path)
            .and_then(serde_json::Value::as_f64)
            .unwrap_or_else(|| panic!("no {path} in {report}"))
    };
    let (before, after) = (number("/volume_before"), number("/volume_after"));
    assert!((after / before - 1.0).abs() < 1e-9, "{before} {after}");
    let error = "/normal_error_degrees";
    assert!(3.0 * number(&format!("{error}/after")) < number(&format!("{error}/before")));
    for field in [
        "/area_before",
        "/area_after",
        "/rms_displacement",
        "/max_displacement",
        "/mean_curvature_rms/before",
        "/mean_curvature_rms/after",
        "/rms_distance_to_truth/after",
    ] {
        assert!(number(field).is_finite(), "{field}");
    }
    assert!(sandbox.read("p.png").starts_with(b"\x89PNG"));
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let sandbox = balls();
    for threads in [1, 3] {
        sandbox.cotan_ok(&format!(
            "smooth noisy.obj -o out{threads}.obj --threads {threads}"
        ));
    }
    assert_eq!(sandbox.read("out1.obj"), sandbox.read("out3.obj"));
}

#[test]
fn detail_at_scale_one_changes_nothing() {
    let sandbox = balls();
    sandbox.cotan_ok("detail noisy.obj -o same.obj --scale 1 --report r.json");
    let moved = sandbox.json("r.json")["max_displacement"].as_f64();
    assert!(moved.is_some_and(|x| x < 1e-12), "{moved:?}");
    sandbox.cotan_ok("detail noisy.obj -o more.obj --scale 2 --report r.json");
    let moved = sandbox.json("r.json")["max_displacement"].as_f64();
    assert!(moved.is_some_and(|x| x > 1e-4), "{moved:?}");
}

#[test]
fn bumps_below_the_size_go_and_a_size_of_0_changes_no_byte() {
    let sandbox = balls();
    sandbox.cotan_ok("smooth noisy.obj -o out.obj --size 20% --truth ball.obj --report r.json");
    let report = sandbox.json("r.json");
    let number = |path: &str| report.pointer(path).and_then(serde_json::Value::as_f64);
    assert!(number("/size").is_some_and(|size| (size - 0.4).abs() < 0.05));
    let error = ["before", "after"].map(|end| {
        number(&format!("/normal_error_degrees/{end}")).unwrap_or_else(|| panic!("{report}"))
    });
    assert!(3.0 * error[1] < error[0], "{error:?}");
    sandbox.cotan_ok("smooth noisy.obj -o same.obj --size 0");
    assert_eq!(sandbox.read("same.obj"), sandbox.read("noisy.obj"));
    // The default is a size.
    sandbox.cotan_ok("smooth noisy.obj -o default.obj");
    sandbox.cotan_ok("smooth noisy.obj -o two.obj --size 2%");
    assert_eq!(sandbox.read("default.obj"), sandbox.read("two.obj"));
    // Its length is that of the mesh, to the digits of the command line.
    let refused = sandbox.cotan("smooth noisy.obj -o x.obj --size 2% --method taubin");
    assert_eq!(refused.code, 2, "{refused:?}");
}

#[test]
fn nothing_outside_of_a_mask_changes_in_the_file() {
    let sandbox = balls();
    let handles: Vec<usize> = (0..40).collect();
    sandbox.write(
        "part.json",
        format!(r#"{{"handles": [{{"vertices": {handles:?}, "fixed": true}}]}}"#),
    );
    let original = String::from_utf8(sandbox.read("noisy.obj")).unwrap();
    for command in [
        "smooth --size 0.5",
        "denoise --method anchored",
        "detail --scale 2",
    ] {
        for mask in [
            "--mask sphere:0,0,1,0.7",
            "--mask box:-2,-2,0.2,2,2,2 --falloff 20%",
            "--mask near:0,0.8",
            "--mask-file part.json --falloff 0",
        ] {
            let (name, rest) = command.split_once(' ').unwrap();
            sandbox.cotan_ok(&format!("{name} noisy.obj {rest} {mask} -o out.obj"));
            let after = String::from_utf8(sandbox.read("out.obj")).unwrap();
            let changed: Vec<usize> = original
                .lines()
                .zip(after.lines())
                .enumerate()
                .filter(|(_, (a, b))| a != b)
                .map(|(line, _)| line)
                .collect();
            let points = sandbox.positions("noisy.obj");
            let inside = |v: usize| match mask.as_bytes()[7] {
                b's' => (points[v] - nalgebra::Point3::new(0.0, 0.0, 1.0)).norm() <= 0.7,
                b'b' => points[v].z >= 0.2,
                b'n' => (points[v] - points[0]).norm() <= 0.8,
                _ => v < 40,
            };
            let first = original.lines().position(|l| l.starts_with("v ")).unwrap();
            assert!(!changed.is_empty(), "{command} {mask}");
            assert!(
                changed.iter().all(|line| inside(line - first)),
                "{command} {mask}"
            );
        }
    }
}

#[test]
fn masks_that_do_not_fit_are_refused() {
    let sandbox = balls();
    let line = |mask: &str| format!("smooth noisy.obj -o out.obj --mask {mask}");
    sandbox.refused(&line("sphere:9,9,9,1"), &["no vertex"]);
    sandbox.refused(&line("near:100000,1"), &["100000"]);
    sandbox.refused(&line("property:weight"), &["weight"]);
    for wrong in ["ball:1", "sphere:0,0,0", "near:1,-1"] {
        assert_eq!(sandbox.cotan(&line(wrong)).code, 2, "{wrong}");
    }
}

#[test]
fn exact_parts_are_left_alone_and_the_report_says_so() {
    let sandbox = Sandbox::with_bar();
    sandbox.cotan_ok("denoise bar.obj -o out.obj --report r.json");
    assert_eq!(sandbox.read("out.obj"), sandbox.read("bar.obj"));
    let report = sandbox.json("r.json");
    let reason = report["reason"].as_str().unwrap_or_default();
    assert!(reason.contains("exactly flat"), "{report}");
    assert!(reason.contains("state a method"), "{report}");
    assert_eq!(report["max_displacement"], 0.0);
}
