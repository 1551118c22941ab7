use super::*;
use crate::attributes::{Attributes, CornerProperty, LabelKind, Labels, Property, UV, Values};
use crate::defects::DefectKind;
use crate::faces::FaceList;
use crate::parsed::Part;
use nalgebra::Point3;
use proptest::prelude::*;

fn document(points: &[[f64; 3]], faces: &[&[u32]]) -> Document {
    let points = points.iter().map(|&p| Point3::from(p)).collect();
    Document::new(points, faces.iter().collect()).unwrap()
}

fn at_most(num_edges: usize) -> Filling {
    Filling::Plain {
        max_edges: NonZeroUsize::new(num_edges).unwrap(),
    }
}

fn sentences(repaired: &Repaired) -> Vec<String> {
    repaired.changes.iter().map(Change::to_string).collect()
}

fn polygons(document: &Document) -> Vec<&[u32]> {
    document.faces().iter().collect()
}

const CORNERS: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [5.0, 5.0, 5.0],
];
const TETRAHEDRON: [&[u32]; 4] = [&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[2, 0, 3]];

#[test]
fn a_sound_mesh_is_not_changed() {
    let sound = document(&CORNERS, &TETRAHEDRON);
    let repaired = Repair::default().apply(&sound).unwrap();
    assert_eq!(repaired.changes, []);
    assert_eq!(polygons(&repaired.document), TETRAHEDRON);
    assert_eq!(repaired.vertex_sources, [0, 1, 2, 3, 4]);
    // Without any step, nothing is changed.
    let broken = document(&CORNERS, &[&[0, 0, 1], &[0, 1, 2], &[0, 1, 2]]);
    assert_eq!(Repair::new().apply(&broken).unwrap().changes, []);
}

#[test]
fn each_change_is_told() {
    let faces: [&[u32]; 7] = [
        &[0, 2, 1],
        &[3, 1, 0],
        &[1, 2, 3],
        &[2, 0, 3],
        &[1, 0, 2],
        &[4, 4, 1],
        &[2, 0, 0, 1],
    ];
    let broken = document(&CORNERS, &faces);
    let repaired = Repair::default().compact().apply(&broken).unwrap();
    assert_eq!(
        sentences(&repaired),
        [
            "dropped face 5: it encloses nothing",
            "trimmed face 6 of 1 corner that enclosed nothing",
            "dropped face 4: it repeats face 0",
            "dropped face 6: it repeats face 0",
            "turned face 1 round",
            "dropped vertex 4: no face uses it",
        ]
    );
    assert!(repaired.document.defects(Weld::Off).unwrap().is_empty());
    assert_eq!(repaired.vertex_sources, [0, 1, 2, 3]);
    assert_eq!(repaired.face_sources, [0, 1, 2, 3].map(Some));
}

#[test]
fn few_faces_turn_and_closed_ones_look_outward() {
    let mut faces: Vec<Vec<u32>> = TETRAHEDRON.iter().map(|f| f.to_vec()).collect();
    faces.iter_mut().for_each(|face| face.reverse());
    let inward: FaceList = faces.iter().collect();
    let points = CORNERS.map(Point3::from).to_vec();
    let document = Document::new(points, inward).unwrap();
    let repaired = Repair::default().apply(&document).unwrap();
    assert_eq!(repaired.changes.len(), 4);
    assert!(repaired.document.inspect(Weld::Off).unwrap().components[0].volume > Some(0.0));
    // An open sheet is oriented by majority.
    let sheet = self::document(
        &[
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 2.0, 0.0],
        ],
        &[&[2, 1, 0], &[0, 2, 3], &[3, 2, 4]],
    );
    let repaired = Repair::default().apply(&sheet).unwrap();
    assert_eq!(sentences(&repaired), ["turned face 0 round"]);
}

#[test]
fn vertices_are_split_and_attributes_go_along() {
    let attributes = Attributes {
        vertices: vec![Property {
            name: "quality".into(),
            components: 1,
            values: Values::F32(vec![0.0, 1.0, 2.0, 3.0, 4.0]),
        }],
        corners: vec![CornerProperty {
            name: UV.into(),
            components: 1,
            values: Values::F64(vec![10.0, 11.0]),
            indices: vec![0, 0, 0, 1, 1, 1],
        }],
        labels: vec![Labels {
            kind: LabelKind::Group,
            names: vec!["a".into(), "b".into()],
            faces: vec![0, 1],
        }],
        ..Attributes::default()
    };
    let bow_tie = document(&CORNERS, &[&[0, 1, 2], &[3, 0, 4]]);
    let bow_tie = bow_tie.with_attributes(attributes).unwrap();
    let repaired = Repair::default().apply(&bow_tie).unwrap();
    assert_eq!(
        sentences(&repaired),
        ["split vertex 0 into 2 (new vertex 5)"]
    );
    assert_eq!(polygons(&repaired.document), [[0, 1, 2], [3, 5, 4]]);
    assert_eq!(repaired.vertex_sources, [0, 1, 2, 3, 4, 0]);
    let attributes = repaired.document.attributes().unwrap();
    assert_eq!(attributes.vertices[0].values.get(5), Some(0.0));
    assert_eq!(attributes.corners[0].indices, [0, 0, 0, 1, 1, 1]);
    assert_eq!(attributes.misfit(6, 2, 6), None);
}

#[test]
fn solids_that_touch_at_an_edge_are_parted() {
    // Two tetrahedra on either side of the edge 0–1.
    let points = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, -1.0],
    ];
    let mut faces = TETRAHEDRON.to_vec();
    faces.extend([&[0u32, 4, 1][..], &[0, 1, 5], &[1, 4, 5], &[4, 0, 5]]);
    let touching = document(&points, &faces);
    assert!(
        Repair::default()
            .apply(&touching)
            .unwrap()
            .document
            .surface()
            .is_err()
    );
    let repaired = Repair::default().split_edges().apply(&touching).unwrap();
    assert_eq!(
        sentences(&repaired),
        [
            "parted 4 faces at the edge between vertices 0 and 1",
            "split vertex 0 into 2 (new vertex 6)",
            "split vertex 1 into 2 (new vertex 7)",
        ]
    );
    let found = repaired.document.inspect(Weld::Off).unwrap();
    assert_eq!((found.components.len(), found.num_holes()), (2, 0));
}

#[test]
fn holes_are_filled_up_to_a_size() {
    let open = document(&CORNERS[..4], &TETRAHEDRON[1..]);
    assert!(
        Repair::new()
            .fill_holes(at_most(2))
            .apply(&open)
            .unwrap()
            .changes
            .is_empty()
    );
    let repaired = Repair::new().fill_holes(at_most(3)).apply(&open).unwrap();
    assert_eq!(
        sentences(&repaired),
        ["filled the hole at vertex 0 (3 edges) with 1 face"]
    );
    assert_eq!(repaired.face_sources[2..], [Some(2), None]);
    assert!(repaired.document.defects(Weld::Off).unwrap().is_empty());
    // The outline of a single face is not a hole.
    let lone = document(&CORNERS, &[&[0, 1, 2]]);
    assert!(
        Repair::new()
            .fill_holes(at_most(9))
            .apply(&lone)
            .unwrap()
            .changes
            .is_empty()
    );
}

/// Three tetrahedra missing 0, 1 and 2 faces, and a lone triangle.
fn four_parts() -> Document {
    let points: Vec<[f64; 3]> = (0..15)
        .map(|v| [f64::from(v * v % 7), f64::from(v % 4), f64::from(v)])
        .collect();
    let mut faces: Vec<Vec<u32>> = Vec::new();
    for part in 0..3 {
        let faces_of_part = TETRAHEDRON[part as usize..].iter();
        faces.extend(faces_of_part.map(|f| f.iter().map(|v| v + 4 * part).collect()));
    }
    faces.push(vec![12, 13, 14]);
    let faces: Vec<&[u32]> = faces.iter().rev().map(Vec::as_slice).collect();
    document(&points, &faces)
}

#[test]
fn specks_go_with_their_vertices() {
    let document = four_parts();
    let repaired = Repair::new().drop_parts_below(3).apply(&document).unwrap();
    assert_eq!(
        sentences(&repaired),
        [
            "dropped the part from face 0 (1 face)",
            "dropped the part from face 1 (2 faces)"
        ]
    );
    assert_eq!(repaired.vertex_sources, [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(repaired.document.faces().len(), 7);
    let error = Repair::new()
        .drop_parts_below(5)
        .apply(&document)
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "every part has fewer than 5 faces (the largest has 4), so nothing would be left; lower the number"
    );
}

#[test]
fn the_largest_parts_stay() {
    let document = four_parts();
    for (num_parts, faces) in [(1, 4), (2, 7), (3, 9), (4, 10), (9, 10)] {
        let num_parts = NonZeroUsize::new(num_parts).unwrap();
        let repaired = Repair::new().keep_largest(num_parts).apply(&document);
        assert_eq!(repaired.unwrap().document.faces().len(), faces);
    }
    // An unused vertex belongs to no part, and a vertex used by a kept part is kept.
    let touching = self::document(&CORNERS, &[&[0, 1, 2], &[0, 1, 3], &[2, 3, 0]]);
    let one = Repair::new()
        .split_vertices()
        .keep_largest(NonZeroUsize::MIN);
    let repaired = one.apply(&touching).unwrap();
    assert_eq!(repaired.vertex_sources, [0, 1, 2, 3, 4]);
}

#[test]
fn vertices_are_merged_where_the_format_numbers_them() {
    let points = [
        CORNERS[0],
        CORNERS[1],
        CORNERS[2],
        CORNERS[1],
        CORNERS[2],
        [1.0, 1.0, 0.0],
    ];
    let seam = document(&points, &[&[0, 1, 2], &[3, 5, 4]]);
    let repaired = Repair::new().weld(Weld::Exact).apply(&seam).unwrap();
    assert_eq!(
        sentences(&repaired),
        [
            "merged vertex 3 into vertex 1",
            "merged vertex 4 into vertex 2"
        ]
    );
    assert_eq!(polygons(&repaired.document), [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(repaired.vertex_sources, [0, 1, 2, 5]);
    assert!(Repair::new().weld(Weld::Within(-1.0)).apply(&seam).is_err());
}

#[test]
fn welding_in_place_keeps_every_vertex_and_parts_fans_for_good() {
    // A bow-tie of two triangles with separate vertices.
    let points = [CORNERS[0], CORNERS[1], CORNERS[2]];
    let points = [points, [CORNERS[0], CORNERS[3], CORNERS[4]]].concat();
    let bow_tie = document(&points, &[&[0, 1, 2], &[3, 4, 5]]);
    assert!(bow_tie.surface_with(Weld::Exact).is_err());
    let repair = Repair::default().weld_in_place(Weld::Exact);
    let repaired = repair.apply(&bow_tie).unwrap();
    assert_eq!(repaired.vertex_sources, [0, 1, 2, 3, 4, 5]);
    let surface = repaired.document.surface().unwrap();
    assert_eq!(surface.mesh().num_vertices(), 6);
    // A seam within a tolerance: one surface, two places in the file.
    let mut points = [CORNERS[0], CORNERS[1], CORNERS[2]];
    let first = points;
    points.iter_mut().for_each(|p| p[2] += 1e-6);
    points[0] = [1.0, 1.0, 0.0];
    let seam = document(&[first, points].concat(), &[&[0, 1, 2], &[3, 5, 4]]);
    let repair = Repair::default().weld_in_place(Weld::Within(1e-5));
    let repaired = repair.apply(&seam).unwrap();
    assert_eq!(repaired.document.positions(), seam.positions());
    let surface = repaired.document.surface().unwrap();
    assert_eq!(surface.mesh().num_vertices(), 4);
}

#[test]
fn a_format_that_welds_is_unwelded_on_request() {
    let points = [CORNERS, CORNERS].concat();
    let seam = document(&points, &[&[0, 1, 2], &[6, 5, 8]]);
    let part = Part {
        name: String::new(),
        vertices: 0..10,
        faces: 0..2,
    };
    let seam = seam.split_into(vec![part]);
    let vertices = |document: &Document| document.surface().unwrap().mesh().num_vertices();
    assert_eq!(vertices(&seam), 4);
    let repaired = Repair::new().apply(&seam).unwrap();
    assert_eq!(vertices(&repaired.document), 4);
    let repaired = Repair::default().weld(Weld::Off).apply(&seam).unwrap();
    assert_eq!(
        (repaired.changes.len(), vertices(&repaired.document)),
        (0, 6)
    );
}

#[test]
fn closed_surfaces_of_two_faces_stay() {
    let quads = document(&CORNERS, &[&[0, 1, 2, 3], &[0, 3, 1, 2]]);
    for sound in [
        document(&CORNERS, &[&[0, 1, 2], &[0, 2, 1]]),
        document(&CORNERS, &[&[0, 1, 3, 2], &[2, 3, 1, 0]]),
    ] {
        let repaired = Repair::default().apply(&sound).unwrap();
        assert_eq!(repaired.changes, []);
    }
    let repaired = Repair::default().apply(&quads).unwrap();
    assert_eq!(repaired.document.faces().len(), 2);
}

#[test]
fn faces_keep_their_part_where_parts_share_vertices() {
    // The second part has no vertices of its own.
    let points = [CORNERS.as_slice(), &[[9.0, 9.0, 9.0]]].concat();
    let faces: [&[u32]; 4] = [&[0, 1, 2], &[3, 3, 4], &[5, 4, 3], &[0, 2, 1]];
    let part = |vertices, faces| Part {
        name: String::new(),
        vertices,
        faces,
    };
    let shared = document(&points, &faces);
    let shared = shared.split_into(vec![part(0..5, 0..2), part(5..6, 2..4)]);
    let repaired = Repair::default().apply(&shared).unwrap();
    assert_eq!(
        repaired.face_sources,
        [Some(0), Some(2), Some(3)],
        "{:?}",
        repaired.changes
    );
}

#[test]
fn a_band_with_a_half_turn_is_cut_only_on_request() {
    let ring: Vec<[f64; 3]> = (0..12)
        .map(|i| [f64::from(i), f64::from(i * i % 7), 0.0])
        .collect();
    let mut faces: Vec<Vec<u32>> = (0..5u32)
        .map(|i| vec![2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1])
        .collect();
    faces.push(vec![10, 1, 0, 11]);
    let faces: Vec<&[u32]> = faces.iter().map(Vec::as_slice).collect();
    let band = document(&ring, &faces);
    let repaired = Repair::default().apply(&band).unwrap();
    assert_eq!(repaired.changes, []);
    let repaired = Repair::default().split_edges().apply(&band).unwrap();
    let found = repaired.document.inspect(Weld::Off).unwrap();
    assert_eq!(found.count(DefectKind::NotOrientable), 0);
    assert!(found.components.len() == 1 && repaired.document.surface().is_ok());
}

/// Random faces that share vertices and edges, often in invalid ways.
fn soup() -> impl Strategy<Value = Document> {
    let point = prop::array::uniform3((0i32..3).prop_map(f64::from));
    let face = prop::collection::vec(0u32..9, 3..7);
    (
        prop::collection::vec(point, 9..10),
        prop::collection::vec(face, 0..14),
    )
        .prop_map(|(points, faces)| {
            let points = points.into_iter().map(Point3::from).collect();
            Document::new(points, faces.iter().collect()).unwrap()
        })
}

fn has_surface_or_nothing(document: &Document) -> bool {
    document.faces().is_empty() || document.surface().is_ok()
}

/// Two meshes in one document whose format splits vertices.
fn split_soup() -> impl Strategy<Value = Document> {
    (soup(), soup()).prop_map(|(a, b)| {
        let (va, fa) = (a.positions().len(), a.faces().len());
        let points = [a.positions(), b.positions()].concat();
        let second = b
            .faces()
            .iter()
            .map(|f| f.iter().map(|v| v + va as u32).collect());
        let faces: FaceList = a
            .faces()
            .iter()
            .map(<[u32]>::to_vec)
            .chain(second)
            .collect();
        let part = |vertices, faces| Part {
            name: String::new(),
            vertices,
            faces,
        };
        let parts = vec![part(0..va, 0..fa), part(va..points.len(), fa..faces.len())];
        Document::new(points, faces).unwrap().split_into(parts)
    })
}

#[test]
fn welded_fans_are_parted_and_keep_their_seams() {
    // Two triangles that meet at a point with separate vertices, so none is copied.
    let points = [
        CORNERS[0], CORNERS[1], CORNERS[2], CORNERS[0], CORNERS[3], CORNERS[4],
    ];
    let part = |vertices, faces| Part {
        name: String::new(),
        vertices,
        faces,
    };
    let bow_tie = document(&points, &[&[0, 1, 2], &[3, 4, 5]]);
    let bow_tie = bow_tie.split_into(vec![part(0..6, 0..2)]);
    assert!(
        bow_tie
            .surface()
            .unwrap_err()
            .to_string()
            .contains("bow-tie")
    );
    let repaired = Repair::default().apply(&bow_tie).unwrap();
    assert_eq!(
        sentences(&repaired),
        ["parted the 2 fans of faces at vertex 0"]
    );
    assert_eq!(repaired.document.positions().len(), 6);
    assert_eq!(
        repaired.document.surface().unwrap().mesh().num_vertices(),
        6
    );
    // With one shared vertex, it is copied, after those of its own part.
    let points = [CORNERS.as_slice(), &CORNERS[..3]].concat();
    let two = document(&points, &[&[0, 1, 2], &[0, 3, 4], &[5, 6, 7]]);
    let two = two.split_into(vec![part(0..5, 0..2), part(5..8, 2..3)]);
    let repaired = Repair::default().apply(&two).unwrap();
    assert_eq!(repaired.vertex_sources, [0, 1, 2, 3, 4, 0, 5, 6, 7]);
    assert_eq!(repaired.document.parts()[1], part(6..9, 2..3));
    assert_eq!(polygons(&repaired.document)[1..], [[5, 3, 4], [6, 7, 8]]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn all_repairs_make_a_surface_of_anything(soup in soup()) {
        for repair in [
            Repair::all(),
            Repair::all().weld(Weld::Within(1.0)),
            Repair::all().weld(Weld::AsFormat).fill_holes(Filling::Off),
        ] {
            let repaired = repair.apply(&soup).unwrap();
            let document = &repaired.document;
            prop_assert!(
                has_surface_or_nothing(document),
                "{:?}\n{:?}\n{:?}",
                document.surface().err(),
                repaired.changes,
                polygons(document)
            );
            let blocking = document.defects(Weld::AsFormat).unwrap();
            let blocking: Vec<_> = blocking.iter().filter(|d| d.kind().is_blocking()).collect();
            prop_assert!(blocking.is_empty(), "{:?}", blocking);
            for (v, p) in document.positions().iter().enumerate() {
                prop_assert_eq!(*p, soup.positions()[repaired.vertex_sources[v]]);
            }
        }
    }

    #[test]
    fn all_repairs_work_where_the_format_splits_vertices(soup in split_soup()) {
        for repair in [Repair::all(), Repair::all().weld(Weld::Within(1.0)), Repair::default().split_edges()] {
            let repaired = repair.apply(&soup).unwrap();
            let document = &repaired.document;
            prop_assert!(
                has_surface_or_nothing(document),
                "{:?}\n{:?}\n{:?}",
                document.surface().err(),
                repaired.changes,
                polygons(document)
            );
            let [a, b] = document.parts() else { panic!("two parts") };
            prop_assert_eq!(a.vertices.end, b.vertices.start);
            prop_assert_eq!(b.vertices.end, document.positions().len());
            prop_assert_eq!((a.faces.end, b.faces.end), (b.faces.start, document.faces().len()));
            for v in a.vertices.clone() {
                prop_assert!(repaired.vertex_sources[v] < 9);
            }
        }
    }

    #[test]
    fn defects_are_what_keeps_a_surface_from_being_built(soup in soup()) {
        let blocking = soup.defects(Weld::Off).unwrap();
        let is_blocked = blocking.iter().any(|d| d.kind().is_blocking());
        if let Err(error) = soup.surface() {
            prop_assert!(is_blocked || soup.faces().is_empty(), "{}", error);
        }
        // Spikes can happen to be harmless.
        let is_sure = blocking
            .iter()
            .any(|d| d.kind().is_blocking() && d.kind() != DefectKind::RepeatedVertex);
        prop_assert!(!is_sure || soup.surface().is_err(), "{:?}", blocking);
    }
}
