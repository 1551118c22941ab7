use super::*;
use crate::file::read;
use crate::limits::Limits;

fn document(text: &str) -> Document {
    read(text, None, &Limits::default()).unwrap()
}

fn inspect(text: &str) -> Inspection {
    document(text).inspect(Weld::AsFormat).unwrap()
}

fn sentences(inspection: &Inspection, kind: DefectKind) -> Vec<String> {
    let of_kind = inspection.defects.iter().filter(|d| d.kind() == kind);
    of_kind.map(Defect::to_string).collect()
}

const TETRAHEDRON: &str =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

#[test]
fn a_closed_mesh_has_none() {
    let tetrahedron = inspect(TETRAHEDRON);
    assert_eq!(tetrahedron.defects, []);
    assert!(tetrahedron.is_closed());
    assert_eq!(
        (tetrahedron.num_edges, tetrahedron.euler_characteristic()),
        (6, 2)
    );
    let [component] = *tetrahedron.components else {
        panic!()
    };
    assert!((component.volume.unwrap() - 1.0 / 6.0).abs() < 1e-15);
}

#[test]
fn edges_vertices_and_faces_are_named() {
    let fin = inspect(&format!("{TETRAHEDRON}v 0 0 -1\nf 1 2 5\n"));
    assert_eq!(
        sentences(&fin, DefectKind::NonManifoldEdge),
        ["the edge between vertices 0 and 1 has 3 faces"]
    );
    let edge = fin
        .defects
        .iter()
        .find(|d| d.kind() == DefectKind::NonManifoldEdge)
        .unwrap();
    assert_eq!((edge.vertices(), edge.faces()), (vec![0, 1], vec![0, 1, 4]));

    let turned = inspect("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n");
    assert_eq!(
        sentences(&turned, DefectKind::InconsistentOrientation),
        ["faces 0 and 1 run through the edge between vertices 0 and 1 in the same direction"]
    );
    let twice = inspect(&format!("{TETRAHEDRON}f 2 1 3\n"));
    assert_eq!(
        sentences(&twice, DefectKind::DuplicateFace),
        ["face 4 repeats face 0"]
    );
    let flat = inspect("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 1 0 0\nv 5 5 5\nf 1 2 3\nf 1 1 2\n");
    assert_eq!(
        sentences(&flat, DefectKind::ZeroArea),
        ["face 0 has a triangle without area"]
    );
    assert_eq!(
        sentences(&flat, DefectKind::RepeatedVertex),
        ["face 1 passes twice through vertex 0"]
    );
    assert_eq!(
        sentences(&flat, DefectKind::DuplicateVertex),
        ["vertex 3 is at the same position as vertex 1"]
    );
    assert_eq!(
        sentences(&flat, DefectKind::UnreferencedVertex),
        ["vertex 3 belongs to no face", "vertex 4 belongs to no face"]
    );
}

#[test]
fn a_band_with_a_half_turn_cannot_be_oriented() {
    let mut band = String::new();
    for i in 0..6 {
        let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 6.0).sin_cos();
        let (dy, dx) = (f64::from(i) * std::f64::consts::PI / 6.0).sin_cos();
        for side in [-0.3, 0.3] {
            let r = 1.0 + side * dx;
            band += &format!("v {} {} {}\n", r * cos, r * sin, side * dy);
        }
    }
    for i in 1..6 {
        band += &format!("f {} {} {} {}\n", 2 * i - 1, 2 * i + 1, 2 * i + 2, 2 * i);
    }
    band += "f 11 2 1 12\n";
    let band = inspect(&band);
    assert_eq!(
        sentences(&band, DefectKind::NotOrientable),
        ["component 0 (from face 0) has only one side: consistent orientation is impossible"]
    );
    assert!(!band.components[0].is_orientable);
    assert_eq!((band.num_holes(), band.num_boundary_edges), (1, 12));
}

#[test]
fn shells_look_outward_unless_they_may_be_cavities() {
    let inward = TETRAHEDRON
        .replace("f 1 3 2", "f 1 2 3")
        .replace("f 1 2 4", "f 1 4 2");
    let inward = inward
        .replace("f 2 3 4", "f 2 4 3")
        .replace("f 3 1 4", "f 3 4 1");
    let found = inspect(&inward);
    assert_eq!(
        sentences(&found, DefectKind::InsideOut),
        ["component 0 (from face 0) is inside out: its faces look inward"]
    );
    let outer =
        "v -9 -9 -9\nv 99 -9 -9\nv -9 99 -9\nv -9 -9 99\nf 5 7 6\nf 5 6 8\nf 6 7 8\nf 7 5 8\n";
    let hollow = inspect(&format!("{inward}{outer}"));
    assert_eq!((hollow.components.len(), hollow.defects.len()), (2, 0));
}

#[test]
fn cuts_of_polygons_are_looked_at_too() {
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 1 1\nv 1 0 1\n";
    // Two quads with a common diagonal: one of them gets the other diagonal.
    let quads = format!("{corners}f 1 2 3 4\nf 1 6 3 5\n");
    let found = inspect(&quads);
    assert_eq!(found.count(DefectKind::CutMeetsEdge), 0);
    assert_eq!(found.count(DefectKind::SeveralFans), 2);
    // Both diagonals of the first are edges of other faces.
    let quad = format!("{corners}f 1 2 3 4\nf 1 3 5\nf 2 4 6\n");
    let found = inspect(&quad);
    assert_eq!(found.count(DefectKind::CutMeetsEdge), 1);
    assert_eq!(found.count(DefectKind::NonManifoldEdge), 0);
    assert!(document(&quad).surface().is_err());
}

#[test]
fn welding_decides_what_is_one_vertex() {
    let split = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 4 6 5\nf 2 4 6\n";
    let apart = inspect(split);
    assert_eq!(apart.count(DefectKind::DuplicateVertex), 2);
    assert_eq!(apart.components.len(), 2);
    let welded = document(split).inspect(Weld::Exact).unwrap();
    assert_eq!(welded.count(DefectKind::DuplicateVertex), 0);
    assert_eq!(
        (
            welded.components.len(),
            welded.num_faces,
            welded.num_holes()
        ),
        (1, 2, 1)
    );
    assert_eq!(
        sentences(&welded, DefectKind::RepeatedVertex),
        ["face 2 passes twice through vertex 1"]
    );
    assert!(document(split).inspect(Weld::Within(f64::NAN)).is_err());
}

#[test]
fn hostile_meshes_end_soon() {
    // All faces on one edge; all vertices at one place; all faces the same; one huge polygon.
    use nalgebra::Point3;
    let n = 30_000u32;
    let points: Vec<_> = (0..n)
        .map(|i| Point3::new(f64::from(i), f64::from(i % 7), 0.0))
        .collect();
    let made = |points: Vec<Point3<f64>>, faces: Vec<Vec<u32>>| {
        Document::new(points, faces.iter().collect()).unwrap()
    };
    let book = made(points.clone(), (2..n).map(|i| vec![0, 1, i]).collect());
    let same = made(
        vec![Point3::origin(); n as usize],
        (2..n).map(|i| vec![i - 2, i - 1, i]).collect(),
    );
    let copies = made(points.clone(), (0..n).map(|_| vec![0, 1, 2]).collect());
    let whirl = made(points, vec![(0..n).map(|i| i % 300).collect()]);
    let clock = std::time::Instant::now();
    for document in [book, same, copies, whirl] {
        for weld in [Weld::Off, Weld::Exact] {
            assert!(!document.defects(weld).unwrap().is_empty());
        }
    }
    assert!(clock.elapsed().as_secs() < 20, "{:?}", clock.elapsed());
}

#[test]
fn only_the_same_outline_is_a_duplicate() {
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let duplicates = |faces: &str| {
        sentences(
            &inspect(&format!("{corners}{faces}")),
            DefectKind::DuplicateFace,
        )
    };
    assert_eq!(duplicates("f 1 2 3 4\nf 1 4 2 3\n"), [""; 0]);
    let repeated = ["face 1 repeats face 0"];
    assert_eq!(duplicates("f 1 2 3 4\nf 3 4 1 2\n"), repeated);
    assert_eq!(duplicates("f 1 2 3 4\nf 2 3 4 1\nf 1 2 3\n"), repeated);
    // Back to back they are closed, unless another face is attached.
    assert_eq!(duplicates("f 1 2 3\nf 1 3 2\n"), [""; 0]);
    assert_eq!(duplicates("f 1 2 3 4\nf 2 1 4 3\n"), [""; 0]);
    assert_eq!(duplicates("f 1 2 3\nf 1 3 2\nf 1 2 4\n"), repeated);
    assert_eq!(
        duplicates("f 1 2 3\nf 1 3 2\nf 2 3 1\n"),
        ["face 1 repeats face 0", "face 2 repeats face 0"]
    );
}
