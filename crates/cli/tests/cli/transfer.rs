//! `cotan detail --map`.

use std::fmt::Write as _;

use cotan::shapes::icosphere;
use cotan_io::Document;
use nalgebra::Point3;

use crate::sandbox::Sandbox;

/// A rippled ball, and a smooth one of twice its size with a quarter of its triangles.
fn balls() -> Sandbox {
    let sandbox = Sandbox::new();
    let ripple = |p: &Point3<f64>| p * (1.0 + 0.01 * (12.0 * p.z).sin());
    let fine = icosphere::<f64>(4);
    let rippled = fine.positions().map(ripple);
    let coarse = icosphere::<f64>(3);
    let large = coarse.positions().map(|p| p * 2.0);
    for (name, shape, positions) in [
        ("rippled.obj", &fine, &rippled),
        ("fine.obj", &fine, fine.positions()),
        ("small.obj", &coarse, coarse.positions()),
        ("large.obj", &coarse, &large),
    ] {
        let document = Document::from_mesh(shape.connectivity(), positions).expect("a document");
        cotan_io::save(&document, sandbox.path(name)).expect("a file");
    }
    sandbox
}

/// The range of the distances from the origin.
fn radii(sandbox: &Sandbox, name: &str) -> [f64; 2] {
    let radii = sandbox.positions(name);
    let radii = radii.iter().map(|p| p.coords.norm());
    radii.fold([f64::INFINITY, 0.0], |[a, b], r| [a.min(r), b.max(r)])
}

#[test]
fn details_arrive_by_every_map() {
    let sandbox = balls();
    sandbox.write("pairs.txt", "0 0\n1 1\n2 2\n3 3\n");
    for (map, more) in [
        ("sphere", ""),
        ("sphere", "--landmarks pairs.txt"),
        ("closest", "--landmarks pairs.txt"),
    ] {
        sandbox.cotan_ok(&format!(
            "detail large.obj -o out.obj --from rippled.obj --map {map} {more} --report r.json \
             --picture p.png"
        ));
        let [low, high] = radii(&sandbox, "out.obj");
        assert!(
            low > 1.97 && low < 1.99 && high > 2.01 && high < 2.03,
            "{map} {more}: {low} {high}"
        );
        let report = sandbox.json("r.json");
        assert_eq!(report["transfer"]["map"], map);
        assert_eq!(report["transfer"]["coverage"], 1.0);
        assert_eq!(report["transfer"]["self_intersecting_after"], 0);
        let stretch = report["transfer"]["stretch_95"].as_f64();
        assert!(stretch.is_some_and(|s| s < 1.5), "{report}");
    }
    // The vertices of the coarse ball are the first of the fine one.
    let mut map = String::from("# triangle and weights\n");
    let fine = icosphere::<f64>(4);
    let mesh = fine.connectivity();
    for v in mesh.vertices().take(642) {
        let face = mesh
            .faces()
            .find(|f| mesh.triangle(*f).contains(&v))
            .expect("a face");
        let weights = mesh.triangle(face).map(|corner| u8::from(corner == v));
        let [a, b, c] = weights;
        writeln!(map, "{} {a} {b} {c}", face.index()).expect("memory");
    }
    sandbox.write("map.txt", &map);
    sandbox.cotan_ok("detail large.obj -o by_file.obj --from rippled.obj --map map.txt --scale 2");
    let [low, high] = radii(&sandbox, "by_file.obj");
    assert!(low < 1.97 && high > 2.03, "{low} {high}");
}

#[test]
fn a_scale_of_zero_writes_the_same_file_and_a_mask_moves_a_part() {
    let sandbox = balls();
    let job = "--from rippled.obj --map closest";
    sandbox.cotan_ok(&format!("detail small.obj -o same.obj {job} --scale 0"));
    assert_eq!(sandbox.read("same.obj"), sandbox.read("small.obj"));
    sandbox.cotan_ok(&format!(
        "detail small.obj -o part.obj {job} --mask plane:0,0,0,0,0,1 --falloff 0.2"
    ));
    let (before, after) = (
        sandbox.positions("small.obj"),
        sandbox.positions("part.obj"),
    );
    let moved = |p: &(&Point3<f64>, &Point3<f64>)| p.0 != p.1;
    let pairs = || before.iter().zip(&after);
    assert!(pairs().filter(moved).count() > 100);
    assert!(pairs().filter(moved).all(|(p, _)| p.z >= 0.0));
}

#[test]
fn details_of_the_same_faces_can_be_scaled_too() {
    let sandbox = balls();
    let job = "detail fine.obj --from rippled.obj";
    sandbox.cotan_ok(&format!("{job} -o one.obj"));
    sandbox.cotan_ok(&format!("{job} -o half.obj --scale 0.5"));
    let [[_, one], [_, half]] = ["one.obj", "half.obj"].map(|name| radii(&sandbox, name));
    assert!(half > 1.001 && half < one, "{half} {one}");
}

#[test]
fn what_has_no_map_is_refused() {
    let sandbox = balls();
    let job = "detail large.obj -o o.obj --from rippled.obj";
    // Other faces, without a map.
    sandbox.refused(job, &["cannot be compared", "--map"]);
    // Two balls of which one contains the other.
    sandbox.refused(
        &format!("{job} --map closest"),
        &["corresponds", "landmarks"],
    );
    sandbox.refused(
        &format!("{job} --map sphere --max-stretch 0.5"),
        &["stretches"],
    );
    sandbox.refused(
        &format!("{job} --map missing.txt"),
        &["missing.txt", "cannot read"],
    );
    sandbox.write("short.txt", "0 1 0 0\n");
    sandbox.refused(&format!("{job} --map short.txt"), &["1 lines", "642"]);
    let lines = |line: &str| format!("{line}\n").repeat(642);
    sandbox.write("far.txt", lines("99999 1 0 0"));
    sandbox.refused(&format!("{job} --map far.txt"), &["no triangle 99999"]);
    sandbox.write("heavy.txt", lines("0 1 1 0"));
    sandbox.refused(&format!("{job} --map heavy.txt"), &["weights"]);
    sandbox.write("none.txt", lines("-"));
    sandbox.refused(&format!("{job} --map none.txt"), &["no part"]);
    sandbox.refused(
        &format!("{job} --map sphere --wavelength 0"),
        &["wavelength"],
    );
    let outcome = sandbox.cotan("detail large.obj -o o.obj --scale 1 --map sphere");
    assert!(
        outcome.code == 2 && outcome.stderr.contains("--from"),
        "{outcome:?}"
    );
    // A file of a map that is to be overwritten.
    sandbox.write("map.obj", lines("0 1 0 0"));
    let outcome = sandbox.cotan("detail large.obj -o map.obj --from rippled.obj --map map.obj");
    assert!(
        outcome.code == 2 && outcome.stderr.contains("map.obj"),
        "{outcome:?}"
    );
}
