use std::num::NonZeroUsize;

use cotan_halfedge::testing::{TriangleFaces, disc_faces, genus_zero_faces};
use nalgebra::Point3;
use proptest::prelude::*;

use crate::document::Document;
use crate::repair::{Change, Filling, Repair, Repaired};

fn document(points: Vec<Point3<f64>>, faces: &[Vec<u32>]) -> Document {
    Document::new(points, faces.iter().collect()).unwrap()
}

fn fill(document: &Document, filling: Filling) -> Repaired {
    Repair::new().fill_holes(filling).apply(document).unwrap()
}

/// V − E + F of a document that is a closed surface.
fn closed(document: &Document) -> i64 {
    let surface = document.surface().unwrap();
    let mesh = surface.mesh();
    assert!(mesh.boundary_loops().is_empty());
    mesh.num_vertices() as i64 - mesh.num_edges() as i64 + mesh.num_faces() as i64
}

/// A square of a regular grid in which two of the corners are single triangles.
fn grid(side: u32, height: impl Fn(f64, f64) -> f64) -> Document {
    let mut points = Vec::new();
    for y in 0..=side {
        for x in 0..=side {
            let (x, y) = (f64::from(x), f64::from(y));
            points.push(Point3::new(x, y, height(x, y)));
        }
    }
    let mut faces = Vec::new();
    for y in 0..side {
        for x in 0..side {
            let a = y * (side + 1) + x;
            let (b, c, d) = (a + 1, a + side + 2, a + side + 1);
            faces.extend([vec![a, b, c], vec![a, c, d]]);
        }
    }
    document(points, &faces)
}

/// A disc of triangles around one vertex.
fn disc(num_edges: u32, height: impl Fn(u32) -> f64) -> Document {
    let rim = (0..num_edges).map(|k| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(num_edges)).sin_cos();
        Point3::new(cos, sin, height(k))
    });
    let mut points = vec![Point3::new(0.0, 0.0, -1.0)];
    points.extend(rim);
    let faces: Vec<Vec<u32>> = (0..num_edges)
        .map(|k| vec![0, 1 + k, 1 + (k + 1) % num_edges])
        .collect();
    document(points, &faces)
}

/// The seven-vertex torus, in which every two vertices are joined, without the faces at one of
/// them.
fn open_torus() -> Document {
    let points = (0..7).map(|v| Point3::new(f64::from(v), f64::from(v * v), f64::from(v % 3)));
    let faces = (0..7u32).flat_map(|i| {
        [[i, i + 1, i + 3], [i, i + 3, i + 2]].map(|face| face.map(|v| v % 7).to_vec())
    });
    let faces: Vec<Vec<u32>> = faces.filter(|face| !face.contains(&6)).collect();
    document(points.collect(), &faces)
}

#[test]
fn corner_ears_are_closed() {
    for side in 1..8 {
        for height in [|_, _| 0.0, |x: f64, y: f64| x * y, |x: f64, _| x.sin()] {
            let repaired = fill(&grid(side, height), Filling::PLAIN);
            assert_eq!(
                closed(&repaired.document),
                2,
                "{side}: {:?}",
                repaired.changes
            );
            assert_eq!(
                repaired.document.faces().len() as u32,
                2 * side * side + 4 * side - 2
            );
        }
    }
}

#[test]
fn a_straight_side_of_a_hole_gets_no_triangle_without_area() {
    // A dome, steep at its square rim: the filling bends by more than a right angle there.
    for side in 2..7u32 {
        let middle = f64::from(side) / 2.0;
        let dome = |x: f64, y: f64| 9.0 - (x - middle).abs().max((y - middle).abs()) * 4.0;
        let repaired = fill(&grid(side, dome), Filling::PLAIN);
        let defects = repaired.document.defects(crate::Weld::AsFormat).unwrap();
        let flat = defects
            .iter()
            .filter(|d| d.kind() == crate::DefectKind::ZeroArea);
        assert_eq!(flat.count(), 0, "{side}");
    }
}

#[test]
fn a_hole_without_a_triangulation_says_so_and_takes_a_vertex() {
    let torus = open_torus();
    let repaired = fill(&torus, Filling::PLAIN);
    let [Change::KeptHole { problem, .. }] = repaired.changes.as_slice() else {
        panic!("{:?}", repaired.changes);
    };
    assert!(problem.starts_with("every way to cut it"), "{problem}");
    assert_eq!(repaired.document.faces().len(), 8);
    let repaired = fill(&torus, Filling::SMOOTH);
    assert_eq!(closed(&repaired.document), 0);
    let Some(&first) = repaired.added_vertices.first() else {
        panic!("{:?}", repaired.changes);
    };
    assert_eq!(first, 7);
}

#[test]
fn long_holes_are_filled_within_seconds() {
    let clock = std::time::Instant::now();
    for height in [|_| 0.0, |k: u32| f64::from(k * k % 17) / 50.0] {
        let disc = disc(10_000, height);
        for filling in [Filling::PLAIN, Filling::SMOOTH] {
            let repaired = fill(&disc, filling);
            assert_eq!(closed(&repaired.document), 2);
            assert!(repaired.added_vertices.len() <= super::MAX_ADDED);
        }
    }
    assert!(clock.elapsed().as_secs() < 120, "{:?}", clock.elapsed());
}

#[test]
fn a_flat_hole_gets_triangles_as_large_as_those_round_it() {
    // A 20 × 20 square without the 10 × 10 squares in its middle, two of whose corners are kept.
    let whole = grid(20, |_, _| 0.0);
    let is_inside = |&v: &u32| {
        let (x, y) = (v % 21, v / 21);
        (6..=14).contains(&x) && (6..=14).contains(&y)
    };
    let faces: Vec<Vec<u32>> = whole
        .faces()
        .iter()
        .filter(|face| !face.iter().any(is_inside))
        .map(<[u32]>::to_vec)
        .collect();
    let open = document(whole.positions().to_vec(), &faces);
    let max_edges = NonZeroUsize::new(40).unwrap();
    let repaired = fill(&open, Filling::Smooth { max_edges });
    let added = repaired.added_vertices.len();
    // There were 81 vertices.
    assert!((50..150).contains(&added), "{added}");
    let positions = repaired.document.positions();
    assert!(positions.iter().all(|p| p.z == 0.0));
    let filled = repaired
        .face_sources
        .iter()
        .zip(repaired.document.faces().iter());
    let filled: Vec<f64> = filled
        .filter(|(source, _)| source.is_none())
        .map(|(_, face)| {
            let [a, b, c] = [face[0], face[1], face[2]].map(|v| positions[v as usize]);
            (b - a).cross(&(c - a)).z / 2.0
        })
        .collect();
    assert!(filled.iter().all(|&area| area > 0.0), "{filled:?}");
    assert!((filled.iter().sum::<f64>() - 99.0).abs() < 1e-9);
    assert!(filled.iter().all(|&area| area < 1.5), "{filled:?}");
}

/// A sphere without the faces at some vertices, no two of which share a neighbour.
fn with_holes(faces: &TriangleFaces, keys: &[u64]) -> (Vec<Vec<u32>>, usize) {
    let mut left: Vec<Vec<u32>> = faces.faces.iter().map(|f| f.to_vec()).collect();
    let mut is_taken = vec![false; faces.num_vertices];
    let mut num_holes = 0;
    for key in keys {
        let center = (*key % faces.num_vertices as u64) as u32;
        let star: Vec<&Vec<u32>> = left.iter().filter(|face| face.contains(&center)).collect();
        let near: Vec<u32> = star.iter().flat_map(|face| face.iter().copied()).collect();
        let is_near = is_taken[center as usize] || near.iter().any(|&v| is_taken[v as usize]);
        if is_near || star.len() + 4 > left.len() {
            continue;
        }
        near.iter().for_each(|&v| is_taken[v as usize] = true);
        left.retain(|face| !face.contains(&center));
        num_holes += 1;
    }
    (left, num_holes)
}

fn points(num_vertices: usize) -> Vec<Point3<f64>> {
    let coordinate = |v: usize, axis: usize| ((v * 7 + axis * 5 + v * v * (axis + 3)) % 101) as f64;
    (0..num_vertices)
        .map(|v| Point3::new(coordinate(v, 0), coordinate(v, 1), coordinate(v, 2)))
        .collect()
}

proptest! {
    // Each hole removes a disc, so a filled sphere is a sphere again.
    #[test]
    fn filled_spheres_with_holes_are_spheres(
        faces in genus_zero_faces(),
        keys in prop::collection::vec(any::<u64>(), 1..6),
        smooth in any::<bool>(),
    ) {
        let (left, num_holes) = with_holes(&faces, &keys);
        let open = document(points(faces.num_vertices), &left);
        let filling = if smooth { Filling::SMOOTH } else { Filling::PLAIN };
        let repaired = fill(&open, filling);
        let is_filled = |change: &&Change| matches!(change, Change::FilledHole { .. });
        prop_assert_eq!(repaired.changes.iter().filter(is_filled).count(), num_holes);
        prop_assert_eq!(closed(&repaired.document), 2);
        prop_assert!(smooth || repaired.added_vertices.is_empty());
    }

    #[test]
    fn filled_discs_with_holes_are_spheres(faces in disc_faces(), smooth in any::<bool>()) {
        let left: Vec<Vec<u32>> = faces.faces.iter().map(|f| f.to_vec()).collect();
        let open = document(points(faces.num_vertices), &left);
        let filling = if smooth { Filling::SMOOTH } else { Filling::PLAIN };
        let repaired = fill(&open, filling);
        prop_assert_eq!(closed(&repaired.document), 2, "{:?}", repaired.changes);
    }
}
