//! Uses of a sphere map: turning it, unwrapping it, `cotan resample` and `cotan morph`.

use cotan::geometry::Surface;
use cotan_io::{Document, UV};
use nalgebra::Point3;

use crate::sandbox::Sandbox;
use crate::sphere::{creature, save, save_without, with_creature};

#[test]
fn three_landmarks_turn_the_sphere() {
    let sandbox = with_creature();
    sandbox.write("l.txt", "40 # to the pole\n\n3\n200\n");
    sandbox.write("l.json", "[40, 3, 200]");
    sandbox.cotan_ok("sphere creature.obj -o text.obj --landmarks l.txt");
    sandbox.cotan_ok("sphere creature.obj -o json.obj --landmarks l.json");
    assert_eq!(sandbox.read("text.obj"), sandbox.read("json.obj"));
    let positions = sandbox.positions("text.obj");
    assert_eq!(positions[40], Point3::new(0.0, 0.0, 1.0));
    assert!(positions[3].y.abs() < 1e-12 && positions[3].x > 0.0);
}

#[test]
fn landmarks_use_the_indices_of_the_file_after_a_repair_too() {
    let sandbox = Sandbox::new();
    save_without(&sandbox, "open.obj", &[7]);
    sandbox.write("moved.obj", behind_a_lone_vertex(&sandbox.read("open.obj")));
    sandbox.write("l.txt", "41 4 101");
    sandbox.cotan_ok("sphere moved.obj -o s.obj --fill-holes --landmarks l.txt");
    assert_eq!(sandbox.positions("s.obj")[41], Point3::new(0.0, 0.0, 1.0));
    sandbox.write("l.txt", "0\n4\n101\n");
    let line = "--quiet sphere moved.obj -o s.obj --fill-holes --landmarks l.txt";
    sandbox.refused(line, &["l.txt", "vertex 0", "no face"]);
}

/// The same OBJ with an unused vertex in front, so that all indices shift by one.
fn behind_a_lone_vertex(obj: &[u8]) -> String {
    let mut moved = String::from("v 9 9 9\n");
    for line in std::str::from_utf8(obj).expect("text").lines() {
        let corners = line.strip_prefix("f ").map(|corners| corners.split(' '));
        let line = match corners {
            Some(corners) => corners.fold("f".to_owned(), |face, v| {
                format!("{face} {}", v.parse::<usize>().expect("a vertex") + 1)
            }),
            None => line.to_owned(),
        };
        moved += &(line + "\n");
    }
    moved
}

#[test]
fn refusals_use_indices_of_the_file() {
    let sandbox = Sandbox::new();
    save_without(&sandbox, "open.obj", &[7]);
    sandbox.write("moved.obj", behind_a_lone_vertex(&sandbox.read("open.obj")));
    let [first, second] = ["open.obj", "moved.obj"].map(|name| -> usize {
        let said = sandbox.cotan(&format!("sphere {name} -o s.obj")).stderr;
        let (_, behind) = said.split_once("the one at vertex ").expect("the vertex");
        let number = behind.split(|c: char| !c.is_ascii_digit()).next().unwrap();
        number.parse().unwrap()
    });
    assert_eq!(second, first + 1);
}

#[test]
fn invalid_landmarks() {
    let sandbox = with_creature();
    let cases: [(&str, &[&str]); 6] = [
        ("", &["three vertices", "has 0"]),
        ("1\n2\n", &["three vertices", "has 2"]),
        ("1\nx\n2\n", &["line 2", "`x`"]),
        ("[1, 2.5, 3]", &["JSON", "vertex indices"]),
        ("0 1 99999", &["no vertex 99999", "numbered from 0"]),
        ("5 5 5", &["one axis"]),
    ];
    for (text, words) in cases {
        sandbox.write("l.txt", text);
        sandbox.refused("sphere creature.obj -o s.obj --landmarks l.txt", words);
    }
    sandbox.refused(
        "sphere creature.obj -o s.obj --landmarks nix.txt",
        &["nix.txt", "cannot read"],
    );
}

#[test]
fn texture_coordinates_are_longitude_and_latitude() {
    let sandbox = with_creature();
    sandbox.cotan_ok("sphere creature.obj -o s.obj --uv");
    check_texture(&cotan_io::load(sandbox.path("s.obj")).unwrap());
}

/// Every corner of a sphere has the longitude and latitude of its vertex.
pub(crate) fn check_texture(document: &Document) {
    let attributes = document.attributes().expect("attributes");
    let uv = attributes
        .corners
        .iter()
        .find(|p| p.name == UV)
        .expect("texture coordinates");
    let cotan_io::Values::F64(values) = &uv.values else {
        panic!("other numbers: {:?}", uv.values)
    };
    let mut seen = 0;
    for (&vertex, &index) in document.faces().corners().iter().zip(&uv.indices) {
        let [u, v] = [0, 1].map(|k| values[2 * index as usize + k]);
        let p = document.positions()[vertex as usize];
        let longitude = 0.5 + p.y.atan2(p.x) / std::f64::consts::TAU;
        let turns = u - longitude;
        assert!(
            (turns - turns.round()).abs() < 1e-6 && u > -1e-9,
            "{u} {longitude}"
        );
        assert!((v - 0.5 - p.z.asin() / std::f64::consts::PI).abs() < 1e-6);
        seen += 1;
    }
    assert_eq!(seen, document.faces().num_corners());
}

#[test]
fn a_geometry_image_has_its_size_and_bounds_in_the_report() {
    let sandbox = with_creature();
    sandbox
        .cotan_ok("sphere creature.obj -o s.obj --geometry-image g.png --size 33 --report r.json");
    let decoder = png::Decoder::new(std::io::Cursor::new(sandbox.read("g.png")));
    let info = decoder.read_info().unwrap().info().clone();
    assert_eq!((info.width, info.height), (33, 33));
    assert_eq!(info.bit_depth, png::BitDepth::Sixteen);
    let image = &sandbox.json("r.json")["geometry_image"];
    assert_eq!(image["size"], 33);
    assert!(image["min"][0].as_f64().unwrap() < image["max"][0].as_f64().unwrap());
}

#[test]
fn a_resampled_shape_has_the_icospheres_counts_and_the_models_volume() {
    let sandbox = with_creature();
    let shape = creature();
    let before = shape.surface().volume();
    for (level, precision) in [(0, "f64"), (3, "f64"), (5, "f32")] {
        sandbox.cotan_ok(&format!(
            "resample creature.obj --level {level} --authalic 1 -o even.obj --report r.json \
             --precision {precision}"
        ));
        let document = cotan_io::load(sandbox.path("even.obj")).unwrap();
        let vertices = 10 * 4usize.pow(level) + 2;
        assert_eq!(document.positions().len(), vertices);
        assert_eq!(document.faces().len(), 2 * vertices - 4);
        let report = sandbox.json("r.json");
        assert_eq!(report["resampled"]["level"], level);
        assert_eq!(report["resampled"]["vertices"], vertices);
        assert_eq!(report["vertices"], shape.num_vertices());
        if level == 5 {
            let even = document.surface().unwrap();
            let surface = Surface::new(even.mesh(), even.positions()).unwrap();
            let after = surface.volume();
            assert!((after / before - 1.0).abs() < 0.05, "{after} {before}");
        }
    }
    for usage in ["--level 9", "--level -1", "--level x", ""] {
        let outcome = sandbox.cotan(&format!("resample creature.obj {usage} -o even.obj"));
        assert_eq!(outcome.code, 2, "{usage}: {outcome:?}");
    }
    save_without(&sandbox, "open.obj", &[7]);
    sandbox.refused(
        "resample open.obj --level 2 -o even.obj",
        &["not closed", "--fill-holes"],
    );
    sandbox.cotan_ok("resample open.obj --level 2 -o even.obj --fill-holes");
}

#[test]
fn a_morph_starts_at_one_shape_and_ends_at_the_other() {
    let sandbox = with_creature();
    save_without(&sandbox, "egg.obj", &[]);
    let shape = |line: &str| {
        sandbox.cotan_ok(&format!("{line} --level 4 -o m.obj"));
        sandbox.positions("m.obj")
    };
    let [a, b] = ["creature.obj", "egg.obj"].map(|name| shape(&format!("resample {name}")));
    let morph = |t: f64| shape(&format!("morph creature.obj egg.obj --align none -t {t}"));
    assert_eq!(morph(0.0), a);
    assert_eq!(morph(1.0), b);
    for ((half, a), b) in morph(0.5).iter().zip(&a).zip(&b) {
        assert!((half - nalgebra::center(a, b)).norm() < 1e-12);
    }
    // The result has the mesh of the first file.
    sandbox.cotan_ok("morph creature.obj egg.obj -t 0 -o m.obj");
    assert_eq!(sandbox.read("m.obj"), sandbox.read("creature.obj"));
    sandbox.cotan_ok("morph creature.obj creature.obj -t 0.5 --align none -o m.obj");
    let same = sandbox.positions("m.obj");
    for (a, b) in same.iter().zip(creature().positions().values()) {
        assert!((a - b).norm() < 1e-9, "{a} {b}");
    }
    for align in ["pose", "areas"] {
        let start = shape(&format!("morph creature.obj egg.obj --align {align} -t 0"));
        assert_eq!(start, a, "{align}");
    }
}

#[test]
fn pairs_of_landmarks_bring_spheres_together() {
    let sandbox = with_creature();
    let turned = creature();
    let positions = turned.positions().map(|p| Point3::new(-p.y, p.x, p.z));
    let turned = turned.with_positions(positions).expect("a surface");
    save(&sandbox, "turned.obj", &turned);
    sandbox.write("pairs.txt", "0 0\n500 500 # the same\n900 900\n");
    let line = "creature.obj turned.obj --level 3 -o m.obj --landmarks pairs.txt";
    sandbox.cotan_ok(&format!("morph {line} -t 1"));
    let end = sandbox.positions("m.obj");
    sandbox.cotan_ok(&format!("morph {line} -t 0"));
    for (a, b) in sandbox.positions("m.obj").iter().zip(&end) {
        assert!((Point3::new(-a.y, a.x, a.z) - b).norm() < 1e-3, "{a} {b}");
    }
    for (text, words) in [
        ("1 1\n", ["at least two pairs", "has 1"]),
        ("1 1\n2\n", ["landmark 2", "but has 1"]),
        ("1 1\n2 99999\n", ["no vertex 99999", "turned.obj"]),
    ] {
        sandbox.write("pairs.txt", text);
        sandbox.refused(&format!("morph {line} -t 0.5"), &words);
    }
}
