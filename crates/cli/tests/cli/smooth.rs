//! `cotan smooth` and `cotan detail`.

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
        "smooth noisy.obj -o out.obj --truth ball.obj --preserve-volume --report r.json \
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
