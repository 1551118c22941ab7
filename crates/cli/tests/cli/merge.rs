//! `cotan merge`.

use std::fmt::Write as _;

use cotan::shapes::icosphere;
use cotan_io::LabelKind;

use crate::sandbox::Sandbox;

/// A ball as OBJ, with texture coordinates and a material.
fn ball(material: &str, turn: f64, offset: f64) -> String {
    let shape = icosphere::<f64>(3);
    let turn = nalgebra::Rotation3::new(nalgebra::Vector3::new(turn, 0.3 * turn, 0.0));
    let mut text = format!("# {material}\nmtllib {material}.mtl\n");
    for p in shape.positions().values() {
        let p = turn * p;
        writeln!(text, "v {} {} {}", p.x, p.y, p.z + offset).expect("memory");
    }
    for p in shape.positions().values() {
        writeln!(text, "vt {} {}", 0.5 + 0.4 * p.x, 0.5 + 0.4 * p.y).expect("memory");
    }
    writeln!(text, "usemtl {material}").expect("memory");
    for corners in shape.to_triangles().chunks(3) {
        let [a, b, c] = [corners[0] + 1, corners[1] + 1, corners[2] + 1];
        writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}").expect("memory");
    }
    text
}

fn balls() -> Sandbox {
    let sandbox = Sandbox::new();
    for (name, turn) in [("skin", 0.0), ("bark", 0.7)] {
        sandbox.write(&format!("{name}.obj"), ball(name, turn, 0.0));
        let library = format!("newmtl {name}\nKd 0.5 0.25 0.125\n");
        sandbox.write(&format!("{name}.mtl"), &library);
    }
    sandbox
}

const HALVES: &str = "--keep-a plane:0,0,-0.04,0,0,-1 --keep-b plane:0,0,0.04,0,0,1";

#[test]
fn both_files_are_in_the_merged_one() {
    for format in ["obj", "ply", "glb"] {
        let sandbox = balls();
        sandbox.cotan_ok(&format!(
            "merge skin.obj bark.obj -o both.{format} {HALVES} --report r.json --picture p.png"
        ));
        let report = sandbox.json("r.json");
        assert_eq!(report["euler_characteristic"], 2, "{format}");
        assert_eq!(report["boundary_loops"], 0, "{format}");
        assert_eq!(report["self_intersecting_faces"], 0, "{format}");
        assert!(sandbox.read("p.png").starts_with(b"\x89PNG"));
        let document = cotan_io::load(sandbox.path(&format!("both.{format}"))).expect("a mesh");
        let surface = document.surface().expect("a surface");
        assert!(surface.mesh().is_closed(), "{format}");
        let attributes = document.attributes().expect("attributes");
        assert!(
            attributes.corner("uv").is_some() || attributes.vertex("uv").is_some(),
            "{format}"
        );
        if format != "ply" {
            let materials = attributes.label(LabelKind::Material).expect("materials");
            let mut names = materials.names.clone();
            names.sort();
            assert_eq!(names, ["bark", "skin"], "{format}");
        }
    }
}

#[test]
fn vertices_away_from_the_seam_keep_every_digit() {
    let sandbox = balls();
    sandbox.cotan_ok(&format!(
        "merge skin.obj bark.obj -o both.obj {HALVES} --band 2"
    ));
    let lines = |file: &str| -> Vec<String> {
        let text = String::from_utf8(sandbox.read(file)).expect("text");
        let lines = text.lines().filter(|line| line.starts_with("v "));
        lines.map(str::to_owned).collect()
    };
    let merged = lines("both.obj");
    for (file, side) in [("skin.obj", -1.0), ("bark.obj", 1.0)] {
        let z = |line: &str| -> f64 {
            let z = line.split(' ').nth(3).and_then(|z| z.parse().ok());
            z.expect("a number")
        };
        let far: Vec<String> = lines(file)
            .into_iter()
            .filter(|l| side * z(l) > 0.6)
            .collect();
        assert!(far.len() > 50);
        for line in far {
            assert!(merged.contains(&line), "{file}: {line}");
        }
    }
}

#[test]
fn a_part_is_fitted_and_threads_change_nothing() {
    let sandbox = balls();
    let away = ball("bark", 0.7, 3.0);
    sandbox.write("away.obj", &away);
    let both = [1, 3].map(|threads| {
        sandbox.cotan_ok(&format!(
            "merge skin.obj away.obj -o m.obj --keep-a plane:0,0,-0.04,0,0,-1 \
             --keep-b plane:0,0,3.04,0,0,1 --place fit --report r.json --threads {threads}"
        ));
        sandbox.read("m.obj")
    });
    assert!(both[0] == both[1]);
    let report = sandbox.json("r.json");
    let moved = report["translation"][2].as_f64().expect("a number");
    assert!((moved + 3.0).abs() < 0.2, "{moved}");
}

#[test]
fn parts_that_cannot_be_joined_are_refused() {
    let sandbox = balls();
    let whole = "--keep-b plane:0,0,9,0,0,-1";
    sandbox.refused(
        &format!("merge skin.obj bark.obj -o m.obj --keep-a plane:0,0,0,0,0,1 {whole}"),
        &["bark.obj", "whole"],
    );
    let nothing = "--keep-b plane:0,0,9,0,0,1";
    sandbox.refused(
        &format!("merge skin.obj bark.obj -o m.obj --keep-a plane:0,0,0,0,0,1 {nothing}"),
        &["bark.obj", "vertex"],
    );
    let ring = "--keep-b box:-2,-2,-0.5,2,2,0.5";
    sandbox.refused(
        &format!("merge skin.obj bark.obj -o m.obj --keep-a plane:0,0,0,0,0,1 {ring}"),
        &["1 loops", "along 2"],
    );
}
