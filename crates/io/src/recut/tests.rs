use cotan_halfedge::HalfedgeMesh;
use cotan_halfedge::testing::closed_faces;
use nalgebra::Point3;
use proptest::prelude::*;

use super::*;

fn points(num_vertices: usize) -> Vec<Point3<f64>> {
    // In general position, and deterministic.
    let coordinate = |v: usize, axis: usize| ((v * 7 + axis * 5 + v * v * (axis + 3)) % 101) as f64;
    (0..num_vertices)
        .map(|v| Point3::new(coordinate(v, 0), coordinate(v, 1), coordinate(v, 2)))
        .collect()
}

/// The triangles of all polygons.
fn cut(polygons: &[Vec<u32>], positions: &[Point3<f64>]) -> Vec<[u32; 3]> {
    let faces: FaceList = polygons.iter().collect();
    let recuts = Recuts::new(Polygons {
        faces: &faces,
        places: &[],
        positions,
    });
    let mut cutter = Cutter::new(positions, faces.num_corners(), &recuts);
    let mut triangles = Vec::new();
    for (face, polygon) in (0u32..).zip(faces.iter()) {
        let before = triangles.len();
        cutter.cut(face, polygon, |t| triangles.push(t));
        assert_eq!(triangles.len() - before, polygon.len() - 2);
    }
    triangles
}

/// V − E + F of the triangles, which form a closed manifold.
fn closed(polygons: &[Vec<u32>], num_vertices: usize) -> i64 {
    let triangles = cut(polygons, &points(num_vertices));
    let mesh = HalfedgeMesh::from_faces(num_vertices, &triangles).unwrap();
    assert!(mesh.boundary_loops().is_empty());
    num_vertices as i64 - mesh.num_edges() as i64 + mesh.num_faces() as i64
}

/// All combinations of first corners of the polygons.
fn rotations(polygons: &[Vec<u32>]) -> Vec<Vec<Vec<u32>>> {
    let mut all = vec![Vec::new()];
    for polygon in polygons {
        all = all
            .into_iter()
            .flat_map(|before: Vec<Vec<u32>>| {
                (0..polygon.len()).map(move |first| {
                    let mut rotated = polygon.clone();
                    rotated.rotate_left(first);
                    let mut list = before.clone();
                    list.push(rotated);
                    list
                })
            })
            .collect();
    }
    all
}

/// `count` quads between the poles 0 and 1, all of which share the diagonal between these.
fn lune(count: u32) -> Vec<Vec<u32>> {
    (0..count)
        .map(|i| vec![0, 2 + i, 1, 2 + (i + 1) % count])
        .collect()
}

#[test]
fn quads_that_share_two_edges_are_cut_apart() {
    // A cube with a vertex in the middle of its top, joined to two corners.
    let cube = vec![
        vec![0, 3, 2, 1],
        vec![0, 1, 5, 4],
        vec![1, 2, 6, 5],
        vec![2, 3, 7, 6],
        vec![3, 0, 4, 7],
        vec![4, 5, 6, 8],
        vec![4, 8, 6, 7],
    ];
    for first in 0..16 {
        let mut cube = cube.clone();
        cube[5].rotate_left(first % 4);
        cube[6].rotate_left(first / 4);
        assert_eq!(closed(&cube, 9), 2);
    }
}

#[test]
fn doublets_in_chains_are_cut_apart() {
    for count in 3..9 {
        assert_eq!(closed(&lune(count), count as usize + 2), 2);
    }
    // Two polygons close each other.
    for quads in rotations(&lune(2)) {
        assert_eq!(closed(&quads, 4), 2);
    }
}

#[test]
fn a_lune_of_many_quads_takes_no_longer_than_its_size() {
    let count = 50_000;
    assert_eq!(closed(&lune(count), count as usize + 2), 2);
}

#[test]
fn a_diagonal_gives_way_to_an_edge_of_other_faces() {
    let quad = vec![vec![0, 1, 2, 3], vec![0, 3, 2], vec![0, 2, 1]];
    for polygons in rotations(&quad) {
        assert_eq!(closed(&polygons, 4), 2);
    }
}

#[test]
fn polygons_back_to_back_share_no_diagonal() {
    for n in [4, 5, 6, 7, 8, 9, 20, 127, 128, 129, 500] {
        let front: Vec<u32> = (0..n).collect();
        let back: Vec<u32> = (0..n).rev().collect();
        assert_eq!(closed(&[front, back], n as usize), 2);
    }
}

#[test]
fn three_hexagons_that_share_diagonals_are_cut_apart() {
    // Three hexagons between the poles 0 and 1, each with two corners on either side.
    let side = |k: u32| [2 + 2 * k, 3 + 2 * k];
    let hexagons: Vec<Vec<u32>> = (0..3)
        .map(|k| {
            let ([a, b], [c, d]) = (side(k), side((k + 1) % 3));
            vec![0, a, b, 1, d, c]
        })
        .collect();
    for polygons in rotations(&hexagons) {
        assert_eq!(closed(&polygons, 8), 2);
    }
}

#[test]
fn polygons_in_nobodys_way_keep_their_cut() {
    // A doublet, and far from it a quad whose lengths favour the other diagonal.
    let mut polygons = lune(3);
    polygons.push(vec![5, 6, 7, 8]);
    let mut positions = points(5);
    positions.extend(
        [[0.0, 0.0], [9.0, 0.0], [10.0, 1.0], [1.0, 1.0]].map(|[x, y]| Point3::new(x, y, 0.0)),
    );
    let triangles = cut(&polygons, &positions);
    assert_eq!(triangles[6..], [[5, 6, 7], [5, 7, 8]]);
}

#[test]
fn what_cannot_be_cut_apart_keeps_its_cut() {
    // Three faces on the same quad: two diagonals are not enough.
    let quads = vec![vec![0, 1, 2, 3]; 3];
    assert_eq!(cut(&quads, &points(4)).len(), 6);
    let whole = vec![vec![0, 1, 2, 3], vec![0, 2, 4], vec![1, 3, 4]];
    assert_eq!(cut(&whole, &points(5)).len(), 4);
}

/// Merges faces of a triangulated surface across edges, in the order of `keys`, while each
/// remains a simple polygon of at most `most` corners.
fn merged(triangles: &[Vec<u32>], keys: &[u64], most: usize) -> Vec<Vec<u32>> {
    let mut polygons = triangles.to_vec();
    for (k, &key) in keys.iter().enumerate() {
        let at = (key as usize).wrapping_add(k) % polygons.len();
        let first = (key >> 32) as usize % polygons[at].len();
        let mut polygon = polygons[at].clone();
        polygon.rotate_left(first);
        let (a, b) = (polygon[0], polygon[1]);
        let runs_back = |p: &[u32]| (0..p.len()).find(|&i| p[i] == b && p[(i + 1) % p.len()] == a);
        let other = (0..polygons.len()).find(|&f| f != at && runs_back(&polygons[f]).is_some());
        let Some(other) = other else { continue };
        let mut neighbour = polygons[other].clone();
        let start = runs_back(&neighbour).unwrap();
        neighbour.rotate_left(start);
        // b … a of the polygon, then the neighbour's corners between a and b.
        polygon.rotate_left(1);
        polygon.extend(&neighbour[2..]);
        let mut corners = polygon.clone();
        corners.sort_unstable();
        corners.dedup();
        if corners.len() < polygon.len() || polygon.len() > most {
            continue;
        }
        polygons[at] = polygon;
        polygons.remove(other);
    }
    polygons
}

proptest! {
    // Merging triangles into polygons preserves the surface, so a valid cut exists: the original
    // one.
    #[test]
    fn joined_triangles_are_cut_to_a_closed_surface_again(
        faces in closed_faces(),
        keys in prop::collection::vec(any::<u64>(), 0..200),
        most in 4..=MAX_CORNERS,
    ) {
        let triangles: Vec<Vec<u32>> = faces.faces.iter().map(|f| f.to_vec()).collect();
        let mesh = faces.mesh().unwrap();
        let expected =
            mesh.num_vertices() as i64 - mesh.num_edges() as i64 + mesh.num_faces() as i64;
        let mut polygons = merged(&triangles, &keys, most);
        for (polygon, key) in polygons.iter_mut().zip(keys.iter().cycle()) {
            let len = polygon.len();
            polygon.rotate_left(*key as usize % len);
        }
        let mut used: Vec<u32> = polygons.concat();
        used.sort_unstable();
        used.dedup();
        prop_assert_eq!(used.len(), faces.num_vertices);
        prop_assert_eq!(closed(&polygons, faces.num_vertices), expected);
    }

    #[test]
    fn the_order_of_the_faces_does_not_matter(
        faces in closed_faces(),
        keys in prop::collection::vec(any::<u64>(), 0..100),
        turn in any::<usize>(),
    ) {
        let triangles: Vec<Vec<u32>> = faces.faces.iter().map(|f| f.to_vec()).collect();
        let polygons = merged(&triangles, &keys, 6);
        let positions = points(faces.num_vertices);
        let sorted = |polygons: &[Vec<u32>]| {
            let mut triangles = cut(polygons, &positions);
            triangles.sort_unstable();
            triangles
        };
        let mut other = polygons.clone();
        other.rotate_left(turn % polygons.len());
        let last = other.len() - 1;
        other.swap(0, last / 2);
        prop_assert_eq!(sorted(&polygons), sorted(&other));
    }
}
