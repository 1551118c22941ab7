use super::*;

use cotan::shapes;
use cotan_io::{Limits, Repair, Weld, read};
use nalgebra::{Matrix4, Point3};
use proptest::prelude::*;

/// A mesh, and a folder for handles files.
struct Bench {
    folder: tempfile::TempDir,
    document: Document,
    processing: ProcessingMesh,
}

impl Bench {
    fn new() -> Self {
        let shape = shapes::icosphere::<f64>(1);
        Self::of(Document::from_mesh(shape.connectivity(), shape.positions()).unwrap())
    }

    fn of(document: Document) -> Self {
        Self {
            folder: tempfile::tempdir().unwrap(),
            processing: document.surface().unwrap(),
            document,
        }
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    fn read(&self, path: &Path) -> (Vec<Constraint>, Vec<Group>) {
        let file = HandlesFile {
            path,
            def: None,
            max_bytes: u64::MAX,
        };
        let flat = file.read(&self.document, &self.processing, None).unwrap();
        let groups = file
            .read_groups(&self.document, &self.processing, None)
            .unwrap();
        (flat, groups)
    }

    fn constraints(&self, groups: &[Group]) -> Vec<Constraint> {
        constraints(groups, self.document.positions())
    }
}

/// Everything but the location, exactly.
fn bits(constraints: &[Constraint]) -> Vec<(usize, Option<[u64; 3]>, Option<u64>)> {
    let one = |c: &Constraint| {
        let goal = match c.goal {
            Goal::Stay => None,
            Goal::To(p) => Some([p.x.to_bits(), p.y.to_bits(), p.z.to_bits()]),
        };
        (c.vertex, goal, c.weight.map(f64::to_bits))
    };
    constraints.iter().map(one).collect()
}

/// Numbers of any magnitude and sign for which no matrix takes the unit sphere out of the finite
/// numbers.
fn number() -> impl Strategy<Value = f64> {
    use proptest::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    (POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO)
        .prop_filter("of sizes that can be added", |x| x.abs() < 1e300)
}

fn motion(num_vertices: usize) -> impl Strategy<Value = GroupMotion> {
    let point = (number(), number(), number()).prop_map(|(x, y, z)| Point3::new(x, y, z));
    prop_oneof![
        Just(GroupMotion::Fixed),
        proptest::collection::vec(number(), 12).prop_map(|numbers| {
            let mut matrix = Matrix4::identity();
            for (k, number) in numbers.into_iter().enumerate() {
                matrix[(k / 4, k % 4)] = number;
            }
            GroupMotion::Matrix(matrix)
        }),
        proptest::collection::vec(point, num_vertices).prop_map(GroupMotion::To),
    ]
}

/// Groups with no vertex in common.
fn groups() -> impl Strategy<Value = Vec<Group>> {
    let weight = proptest::option::of(1e-300..1e300);
    let sizes = proptest::collection::vec((1usize..6, weight), 1..6);
    let with_motions = sizes.prop_flat_map(|sizes| {
        let motions: Vec<_> = sizes.iter().map(|&(size, _)| motion(size)).collect();
        (Just(sizes), motions)
    });
    let vertices = Just((0..42usize).collect::<Vec<_>>()).prop_shuffle();
    (with_motions, vertices).prop_map(|((sizes, motions), vertices)| {
        let mut rest = vertices.into_iter();
        let sizes = sizes.into_iter().zip(motions);
        sizes
            .map(|((size, weight), motion)| Group {
                vertices: rest.by_ref().take(size).collect(),
                motion,
                turn: None,
                weight,
            })
            .collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn written_handles_read_back_bit_for_bit(groups in groups()) {
        let bench = Bench::new();
        let path = bench.write("h.json", &to_json(&groups));
        let (flat, read) = bench.read(&path);
        prop_assert_eq!(bits(&flat), bits(&bench.constraints(&groups)));
        prop_assert_eq!(bits(&flat), bits(&bench.constraints(&read)));
        prop_assert_eq!(to_json(&read), to_json(&groups));
        let without_mesh = from_json(&to_json(&groups)).unwrap();
        prop_assert_eq!(to_json(&without_mesh), to_json(&groups));
    }
}

#[test]
fn groups_agree_with_the_list_of_vertices() {
    let bench = Bench::new();
    let json = r#"{"handles": [
      {"vertices": [3, 3, 1], "fixed": true},
      {"vertices": {"sphere": {"center": [0, 0, 0], "radius": 2}}, "weight": 3,
       "transform": {"scale": 1.1}},
      {"vertices": [7, 2], "weight": 0.1, "to": [[0.1, 1e-7, 3], [-0.0, 2, 5e-324]]}
    ]}"#;
    // The handle for the whole sphere contradicts the others, so each is tested alone.
    let file: serde_json::Value = serde_json::from_str(json).unwrap();
    for handle in file["handles"].as_array().unwrap() {
        let text = serde_json::json!({ "handles": [handle] }).to_string();
        let path = bench.write("h.json", &text);
        let (flat, groups) = bench.read(&path);
        assert_eq!(groups.len(), 1);
        assert_eq!(bits(&flat), bits(&bench.constraints(&groups)));
        assert_eq!(flat, bench.constraints(&groups));
    }
}

#[test]
fn lines_of_text_are_groups_of_one() {
    let bench = Bench::new();
    let path = bench.write("h.txt", "3 0.1 0.2 0.3 # a\n\n5 1 2 3\n");
    let (flat, groups) = bench.read(&path);
    assert_eq!(groups.len(), 2);
    assert_eq!(groups[1].vertices, [5]);
    assert_eq!(bits(&flat), bits(&bench.constraints(&groups)));
}

#[test]
fn a_sel_file_has_a_fixed_and_a_moved_group() {
    let bench = Bench::new();
    let statuses: String = (0..42).map(|v| format!("{}\n", v % 3)).collect();
    let path = bench.write("h.sel", &statuses);
    bench.write("h.def", "0 -1 0 0.1\n1 0 0 0\n0 0 1.1 0\n0 0 0 1\n");
    let (flat, groups) = bench.read(&path);
    let [fixed, moved] = groups.as_slice() else {
        panic!("{groups:?}");
    };
    assert_eq!(fixed.motion, GroupMotion::Fixed);
    assert!(matches!(moved.motion, GroupMotion::Matrix(_)), "{moved:?}");
    let mut by_vertex = bench.constraints(&groups);
    by_vertex.sort_by_key(|c| c.vertex);
    assert_eq!(bits(&flat), bits(&by_vertex));

    let only_fixed = bench.write("f.sel", &statuses.replace('2', "1"));
    let (flat, groups) = bench.read(&only_fixed);
    assert_eq!((groups.len(), flat.len()), (1, 14));
}

#[test]
fn welded_within_a_distance_the_points_are_kept() {
    let file = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0.001 0\nv 0 1.001 0\nv 1 1 0\nf 1 2 3\nf 4 6 5\n";
    let document = read(file, None, &Limits::default()).unwrap();
    let mut bench = Bench::of(document);
    let weld = Weld::Within(0.01);
    bench.processing = bench.document.surface_with(weld).unwrap();
    let json = r#"{"handles": [{"vertices": [3, 5], "transform": {"scale": 3}}]}"#;
    let (flat, groups) = bench.read(&bench.write("h.json", json));
    assert!(matches!(groups[0].motion, GroupMotion::To(_)), "{groups:?}");
    assert_eq!(bits(&flat), bits(&bench.constraints(&groups)));
}

#[test]
fn copies_of_a_repair_become_the_vertex_of_the_file() {
    let bow_tie = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3\nf 1 4 5\n";
    let document = read(bow_tie, None, &Limits::default()).unwrap();
    let repaired = Repair::default().apply(&document).unwrap();
    let file_vertices = FileVertices::new(5, repaired.vertex_sources);
    let bench = Bench::of(repaired.document);
    let in_file = |groups: &[Group]| {
        groups_in_file(groups, &bench.document, &bench.processing, &file_vertices)
    };
    let group = |vertices: &[usize], motion| Group {
        vertices: vertices.to_vec(),
        motion,
        weight: None,
        turn: None,
    };
    let both = [group(&[0, 2, 5], GroupMotion::Fixed)];
    let written = in_file(&both).unwrap();
    assert_eq!(written[0].vertices, [0, 2]);
    let path = bench.write("h.json", &to_json(&written));
    let file = HandlesFile {
        path: &path,
        def: None,
        max_bytes: u64::MAX,
    };
    let read = file.read_groups(&bench.document, &bench.processing, Some(&file_vertices));
    assert_eq!(read.unwrap()[0].vertices, [0, 5, 2]);

    let lone = [group(&[5], GroupMotion::Fixed)];
    let error = in_file(&lone).unwrap_err().to_string();
    assert!(error.contains("vertex 0"), "{error}");
    let at = |x: f64| Point3::new(x, 0.0, 0.0);
    let apart = [group(&[0, 5], GroupMotion::To(vec![at(1.0), at(2.0)]))];
    assert!(in_file(&apart).is_err());
    let together = [group(&[0, 5], GroupMotion::To(vec![at(1.0), at(1.0)]))];
    assert_eq!(
        in_file(&together).unwrap()[0].motion,
        GroupMotion::To(vec![at(1.0)])
    );
}

#[test]
fn selections_that_need_a_mesh_are_refused_without_one() {
    for (handle, word) in [
        (
            r#""vertices": {"box": {"min": [0,0,0], "max": [1,1,1]}}, "fixed": true"#,
            "list",
        ),
        (r#""vertices": [1], "transform": {"scale": 2}"#, "a matrix"),
        (r#""vertices": [1], "to": []"#, "1 vertices but 0"),
        (
            r#""vertices": [1], "transform": {"matrix": [[1, 2]]}"#,
            "1 rows",
        ),
        (
            r#""vertices": [1], "fixed": true, "weight": -1"#,
            "weight -1",
        ),
        (r#""vertices": [-1], "fixed": true"#, "handle 0"),
    ] {
        let error = from_json(&format!("{{\"handles\": [{{{handle}}}]}}"));
        let error = error.unwrap_err().to_string();
        assert!(error.contains(word), "{handle}: {error}");
    }
}

#[test]
fn a_file_of_groups_has_one_handle_per_line() {
    let empty = Group {
        vertices: Vec::new(),
        motion: GroupMotion::Fixed,
        weight: None,
        turn: None,
    };
    let one = Group {
        vertices: vec![4, 2],
        weight: Some(2.5),
        turn: None,
        ..empty.clone()
    };
    assert_eq!(
        to_json(&[empty, one]),
        "{\"handles\": [\n  {\"vertices\":[4,2],\"fixed\":true,\"weight\":2.5}\n]}\n"
    );
}

#[test]
fn a_turn_of_more_than_half_a_turn_is_written_and_read() {
    let bench = Bench::new();
    let turn = nalgebra::Vector3::new(0.0, 5.0, 1.0);
    let group = |turn: nalgebra::Vector3<f64>| Group {
        vertices: vec![3, 7, 9],
        motion: GroupMotion::Matrix(nalgebra::Rotation3::new(turn).to_homogeneous()),
        weight: None,
        turn: Some(turn),
    };
    let text = to_json(&[group(turn)]);
    let path = bench.write("h.json", &text);
    let (flat, groups) = bench.read(&path);
    let alone = from_json(&text).unwrap();
    let stated = flat.iter().map(|c| c.turn);
    for read in stated.chain([groups[0].turn, alone[0].turn]) {
        assert!((read.unwrap() - turn).norm() < 1e-12, "{read:?}");
    }
    let again = bench.constraints(&groups);
    assert!(again.iter().all(|c| c.turn == groups[0].turn));
    // A smaller turn is that of the matrix.
    let small = to_json(&[group(0.5 * turn)]);
    assert!(!small.contains("turn"), "{small}");
    let lone = r#"{"handles": [{"vertices": [1], "transform": {"turn": [0, 300, 0]}}]}"#;
    let file = HandlesFile {
        path: &bench.write("lone.json", lone),
        def: None,
        max_bytes: u64::MAX,
    };
    let read = file.read(&bench.document, &bench.processing, None);
    let error = read.unwrap_err().to_string();
    assert!(error.contains("rotate"), "{error}");
}
