//! Surfaces that are not manifold or not consistently oriented: their copies of a vertex share one
//! row, and jobs treat them as one surface.
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::f64::consts::PI;

use cotan::geometry::testing::{rigid_motions, surfaces};
use cotan::halfedge::HalfedgeMesh;
use cotan::prelude::*;
use cotan::shapes::{bar, icosphere, torus};
use cotan::smooth::{
    BumpSize, BySizeOptions, DetailOptions, ScaledCurvature, SmoothMethod, SmoothOptions,
    edit_detail, smooth, smooth_by_size,
};
use nalgebra::Translation3;
use proptest::prelude::*;

/// Any list of triangles.
#[derive(Clone)]
struct Model {
    name: &'static str,
    positions: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
}

impl Model {
    /// A model from triangles whose equal corners are one vertex.
    fn glued(name: &'static str, triangles: &[[[f64; 3]; 3]]) -> Self {
        let mut positions: Vec<[f64; 3]> = Vec::new();
        let mut number = |p: [f64; 3]| {
            let known = positions.iter().position(|q| *q == p);
            let index = known.unwrap_or_else(|| {
                positions.push(p);
                positions.len() - 1
            });
            index as u32
        };
        let faces = triangles.iter().map(|t| t.map(&mut number)).collect();
        Self {
            name,
            positions,
            faces,
        }
    }

    /// A grid of `n` × `m` quads, whose vertices are given by an index and a position.
    fn grid(
        name: &'static str,
        [n, m]: [usize; 2],
        num_vertices: usize,
        index: impl Fn(usize, usize) -> usize,
        position: impl Fn(f64, f64) -> [f64; 3],
    ) -> Self {
        let mut positions = vec![[0.0; 3]; num_vertices];
        for i in (0..=n).rev() {
            for j in (0..=m).rev() {
                positions[index(i, j)] = position(i as f64 / n as f64, j as f64 / m as f64);
            }
        }
        let mut faces = Vec::new();
        for i in 0..n {
            for j in 0..m {
                let corner = |di, dj| index(i + di, j + dj) as u32;
                let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        Self {
            name,
            positions,
            faces,
        }
    }

    fn mesh(&self) -> Mesh<f64> {
        let indices = self.faces.as_flattened();
        let built = MeshBuilder::new()
            .cut_into_pieces()
            .triangles(&self.positions, indices);
        built.unwrap().mesh
    }

    /// Faces reversed where a bit of a pseudo-random sequence is set.
    fn turned(&self, seed: u64) -> Self {
        let mut random = seed;
        let mut turned = self.clone();
        for face in &mut turned.faces {
            if next(&mut random) % 2 == 1 {
                face.reverse();
            }
        }
        turned
    }

    /// Other indices, and the new one of every vertex.
    fn renumbered(&self) -> (Self, Vec<usize>) {
        let n = self.positions.len();
        let step = (n / 2..).find(|k| gcd(*k, n) == 1).unwrap();
        let number: Vec<usize> = (0..n).map(|i| (i * step + 5) % n).collect();
        let mut other = self.clone();
        for (i, p) in self.positions.iter().enumerate() {
            other.positions[number[i]] = *p;
        }
        let new = |v: &u32| number[*v as usize] as u32;
        other.faces = self
            .faces
            .iter()
            .rev()
            .map(|f| [new(&f[1]), new(&f[2]), new(&f[0])])
            .collect();
        (other, number)
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn next(state: &mut u64) -> u64 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1);
    *state >> 33
}

fn triangles_of(shape: &Mesh<f64>, shift: [f64; 3]) -> Vec<[[f64; 3]; 3]> {
    let surface = shape.surface();
    let corner = |v| (surface.position(v) + Vector3::from(shift)).into();
    let faces = shape.connectivity().faces();
    faces
        .map(|f| shape.connectivity().triangle(f).map(corner))
        .collect()
}

fn book(num_pages: usize) -> Model {
    let name = ["book of 3", "book of 4", "book of 5", "book of 6"][num_pages - 3];
    let mut triangles = Vec::new();
    for page in 0..num_pages {
        let angle = 2.0 * PI * page as f64 / num_pages as f64 + 0.1;
        let at = |i: usize, j: usize| {
            let (r, z) = (0.25 * i as f64, 0.25 * j as f64);
            [r * angle.cos(), r * angle.sin(), z]
        };
        for i in 0..5 {
            for j in 0..10 {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    Model::glued(name, &triangles)
}

fn moebius() -> Model {
    let (n, m) = (40, 5);
    let index = |i: usize, j: usize| {
        if i == n { m - j } else { i * (m + 1) + j }
    };
    Model::grid("Möbius strip", [n, m], n * (m + 1), index, |s, t| {
        let (u, v) = (2.0 * PI * s, t - 0.5);
        let r = 1.5 + v * (0.5 * u).cos();
        [r * u.cos(), r * u.sin(), v * (0.5 * u).sin()]
    })
}

fn klein() -> Model {
    let (n, m) = (36, 18);
    let index = |i: usize, j: usize| match i == n {
        true => (m - j) % m,
        false => i * m + j % m,
    };
    Model::grid("Klein bottle", [n, m], n * m, index, |s, t| {
        let (u, v) = (2.0 * PI * s, 2.0 * PI * t);
        let (c, s) = ((0.5 * u).cos(), (0.5 * u).sin());
        let r = 2.0 + c * v.sin() - s * (2.0 * v).sin();
        [r * u.cos(), r * u.sin(), s * v.sin() + c * (2.0 * v).sin()]
    })
}

fn cubes(name: &'static str, shift: [f64; 3]) -> Model {
    let cube = bar::<f64>([1.0; 3], [4; 3]);
    let mut triangles = triangles_of(&cube, [0.0; 3]);
    triangles.extend(triangles_of(&cube, shift));
    Model::glued(name, &triangles)
}

/// A sphere with quads of which two share two edges, cut along the same diagonal.
fn doublets() -> Model {
    let sphere = icosphere::<f64>(3);
    let mut model = Model::glued("doublets", &triangles_of(&sphere, [0.0; 3]));
    for k in [10, 200, 300, 451] {
        let [a, c, _] = model.faces[k];
        let middle = |axis: usize| {
            let [p, q] = [a, c].map(|v| model.positions[v as usize][axis]);
            0.52 * (p + q)
        };
        let d = model.positions.len() as u32;
        model.positions.push([middle(0), middle(1), middle(2)]);
        model.faces.extend([[a, c, d], [c, a, d]]);
    }
    model
}

/// A bar with a tangle of triangles between its vertices.
fn soup() -> Model {
    let shape = bar::<f64>([4.0, 1.0, 1.0], [12, 3, 3]);
    let mut model = Model::glued("soup", &triangles_of(&shape, [0.0; 3]));
    let n = model.positions.len() as u64;
    let mut random = 7;
    while model.faces.len() < 420 {
        let face = [(); 3].map(|()| (next(&mut random) % n) as u32);
        let near = |a: u32, b: u32| {
            let [a, b] = [a, b].map(|v| model.positions[v as usize][0]);
            (a - b).abs() < 0.8
        };
        let [a, b, c] = face;
        if a != b && b != c && c != a && near(a, b) && near(b, c) {
            model.faces.push(face);
        }
    }
    model
}

fn models() -> Vec<Model> {
    vec![
        book(3),
        book(4),
        book(6),
        moebius(),
        klein(),
        cubes("cubes with an edge", [1.0, 1.0, 0.0]),
        cubes("cubes with a vertex", [1.0, 1.0, 1.0]),
        cubes("cubes with a face", [1.0, 0.0, 0.0]),
        doublets(),
        soup(),
    ]
}

/// The lowest and the highest eighth of the rows along the longest axis.
fn ends(positions: &[[f64; 3]]) -> [Vec<usize>; 2] {
    let extent = |axis: usize| {
        let values = || positions.iter().map(|p| p[axis]);
        values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
    };
    let longest = (0..3)
        .max_by(|a, b| extent(*a).total_cmp(&extent(*b)))
        .unwrap();
    let along = |p: [f64; 3]| p[longest] + 1e-3 * p[0] + 2e-3 * p[1] + 3e-3 * p[2];
    let mut order: Vec<usize> = (0..positions.len()).collect();
    order.sort_by(|a, b| along(positions[*a]).total_cmp(&along(positions[*b])));
    let held = positions.len() / 8;
    [order[..held].to_vec(), order[order.len() - held..].to_vec()]
}

fn motion() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.3, -0.2, 0.25), Vector3::new(0.2, 0.35, -0.3))
}

/// Both ends moved, the first by `low` and the second by `high`; `number` is the index of each
/// vertex.
fn handles(
    model: &Model,
    number: &[usize],
    low: Isometry3<f64>,
    high: Isometry3<f64>,
) -> Handles<f64> {
    let [first, second] = ends(&model.positions).map(|rows| {
        rows.into_iter()
            .map(|v| VertexId::new(number[v]))
            .collect::<Vec<_>>()
    });
    Handles::new()
        .transform(first, low.to_homogeneous())
        .transform(second, high.to_homogeneous())
}

fn deformed(mesh: &Mesh<f64>, handles: &Handles<f64>) -> Positions<f64> {
    let options = DeformOptions::default().tolerance(1e-11);
    deform(mesh, handles, &options).unwrap().positions
}

fn assert_no_crack(mesh: &Mesh<f64>, positions: &Positions<f64>, name: &str) {
    for (copy, row) in mesh.connectivity().copies() {
        assert_eq!(positions[copy], positions[row], "{name}");
    }
}

fn farthest(a: &Positions<f64>, b: impl Fn(usize) -> Point3<f64>, rows: usize) -> f64 {
    let off = |i: usize| (a.as_slice()[i] - b(i)).norm();
    (0..rows).map(off).fold(0.0, f64::max)
}

#[test]
fn rigid_motions_are_exact_and_handles_in_place_change_nothing() {
    for model in models() {
        let mesh = model.mesh();
        assert!(mesh.connectivity().has_copies(), "{}", model.name);
        let same: Vec<usize> = (0..model.positions.len()).collect();
        let moved = deformed(&mesh, &handles(&model, &same, motion(), motion()));
        let goal = |i: usize| motion() * mesh.positions().as_slice()[i];
        let off = farthest(&moved, goal, same.len());
        println!("{}: rigid motion {off:.1e}", model.name);
        assert!(off < 1e-9, "{}: {off:e}", model.name);
        assert_no_crack(&mesh, &moved, model.name);
        let identity = Isometry3::identity();
        let still = deformed(&mesh, &handles(&model, &same, identity, identity));
        assert_eq!(&still, mesh.positions(), "{}", model.name);
    }
}

#[test]
fn turned_faces_and_other_indices_change_nothing() {
    for model in models() {
        let mesh = model.mesh();
        let same: Vec<usize> = (0..model.positions.len()).collect();
        let bend = |model: &Model, number: &[usize]| {
            handles(model, number, Isometry3::identity(), motion())
        };
        let first = deformed(&mesh, &bend(&model, &same));
        assert_no_crack(&mesh, &first, model.name);

        let turned = model.turned(3).mesh();
        let second = deformed(&turned, &bend(&model, &same));
        assert_no_crack(&turned, &second, model.name);
        let off = farthest(&first, |i| second.as_slice()[i], same.len());

        let (other, number) = model.renumbered();
        let other = other.mesh();
        let third = deformed(&other, &bend(&model, &number));
        let far = farthest(&first, |i| third.as_slice()[number[i]], same.len());
        println!("{}: turned {off:.1e}, renumbered {far:.1e}", model.name);
        assert!(off < 1e-9 && far < 1e-9, "{}: {off:e} {far:e}", model.name);
    }
}

/// The mesh cut along its edges with a bit of the seed, whose copies share the rows of the uncut
/// one.
fn cut(mesh: &Mesh<f64>, seed: u64) -> Mesh<f64> {
    let connectivity = mesh.connectivity();
    let mut random = seed;
    let is_cut: Vec<bool> = connectivity
        .edges()
        .map(|_| next(&mut random).is_multiple_of(3))
        .collect();
    // The fans that are left at each vertex, in the order of their halfedges.
    let mut piece_of = vec![u32::MAX; connectivity.num_halfedges()];
    let mut rows: Vec<VertexId> = Vec::new();
    let n = connectivity.num_vertices();
    for v in connectivity.vertices() {
        let around: Vec<HalfedgeId> = connectivity.outgoing_halfedges(v).collect();
        let is_border =
            |h: &HalfedgeId| is_cut[h.edge().index()] || connectivity.is_boundary_edge(h.edge());
        let first = around.iter().position(is_border).unwrap_or(0);
        let mut current = v.index() as u32;
        let mut is_first = true;
        for k in 0..around.len() {
            let h = around[(first + k) % around.len()];
            let starts = is_border(&h) && !connectivity.is_boundary_halfedge(h);
            if starts && !std::mem::take(&mut is_first) {
                rows.push(v);
                current = (n + rows.len() - 1) as u32;
            }
            piece_of[h.index()] = current;
        }
    }
    let faces: Vec<Vec<u32>> = connectivity
        .faces()
        .map(|f| {
            connectivity
                .face_halfedges(f)
                .map(|h| piece_of[h.index()])
                .collect()
        })
        .collect();
    let pieces = HalfedgeMesh::from_faces(n + rows.len(), &faces).unwrap();
    let pieces = pieces.with_copies(rows).unwrap();
    let positions = pieces.to_vertices(mesh.positions().clone());
    Mesh::new(pieces, positions).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// With all terms of the energy: struts and volume are those of the joined surface.
    #[test]
    fn what_is_cut_and_shared_deforms_as_the_uncut(
        mesh in surfaces(),
        motion in rigid_motions(),
        seed in any::<u64>(),
    ) {
        let pieces = cut(&mesh, seed);
        let rows = mesh.to_positions::<f64>();
        let [low, high] = ends(&rows).map(|rows| rows.into_iter().map(VertexId::new).collect::<Vec<_>>());
        prop_assume!(!low.is_empty());
        let size = mesh.surface().bounding_box().diagonal();
        let lift = Translation3::from(motion.translation.vector.normalize() * 0.05 * size);
        let center = Translation3::from(mesh.surface().bounding_box().center().coords);
        let turn = center * Isometry3::rotation(Vector3::new(0.2, 0.3, -0.1)) * center.inverse();
        let mut handles = Handles::new().fix(low).transform(high, (lift * turn).to_homogeneous());
        for (component, v) in firsts(&mesh).into_iter().enumerate() {
            if component > 0 {
                handles = handles.transform([v], (lift * turn).to_homogeneous());
            }
        }
        let options = DeformOptions::default()
            .tolerance(0.0)
            .iteration_limit(6);
        let run = |mesh: &Mesh<f64>| deform(mesh, &handles, &options).map(|d| d.positions);
        let (whole, shared) = (run(&mesh), run(&pieces));
        if let (Ok(whole), Ok(shared)) = (&whole, &shared) {
            let off = farthest(whole, |i| shared.as_slice()[i], rows.len());
            prop_assert!(off <= 1e-10 * size, "{off:e}");
            assert_no_crack(&pieces, shared, "cut");
        }
        prop_assert_eq!(whole.is_ok(), shared.is_ok());
    }
}

/// The first vertex of every component.
fn firsts(mesh: &Mesh<f64>) -> Vec<VertexId> {
    let components = mesh.connectivity().components();
    let of = |k| {
        mesh.connectivity()
            .vertices()
            .find(|v| components.of(*v) == k)
    };
    (0..components.count()).filter_map(of).collect()
}

#[test]
fn smoothing_and_details_open_no_crack_and_do_not_mind_turned_faces() {
    for model in models() {
        let noisy = |mesh: Mesh<f64>| {
            let mut random = 11;
            let mut rows = mesh.connectivity().to_rows(mesh.positions());
            for p in rows.values_mut() {
                let mut wiggle = || (next(&mut random) % 1000) as f64 * 2e-5 - 0.01;
                *p += Vector3::new(wiggle(), wiggle(), wiggle());
            }
            let (connectivity, _) = mesh.into_parts();
            let positions = connectivity.to_vertices(rows);
            Mesh::new(connectivity, positions).unwrap()
        };
        let (mesh, turned) = (noisy(model.mesh()), noisy(model.turned(3).mesh()));
        let n = model.positions.len();
        for method in SmoothMethod::ALL {
            let options = SmoothOptions::default().method(*method);
            let by =
                |mesh: &Mesh<f64>| smooth(mesh, &Handles::new(), &options).map(|s| s.positions);
            if *method == SmoothMethod::Paper {
                // Held at a single vertex, it does not converge; where sheets meet its system can
                // be singular, which is reported.
                continue;
            }
            let name = format!("{} {}", model.name, method.name());
            let smoothed = by(&mesh).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_no_crack(&mesh, &smoothed, &name);
            if *method == SmoothMethod::FeatureEdges {
                // Dihedral angles where several sheets meet depend on which of them are paired.
                continue;
            }
            let other = by(&turned).unwrap();
            let off = farthest(&smoothed, |i| other.as_slice()[i], n);
            println!("{name}: turned {off:.1e}");
            assert!(off < 1e-9, "{name}: {off:e}");
        }
        let by_size = |mesh: &Mesh<f64>| {
            let size = BumpSize::Share(0.1);
            let options = BySizeOptions::default();
            let smoothed = smooth_by_size(mesh, &Handles::new(), &size, &options);
            smoothed.unwrap().positions
        };
        let (smoothed, other) = (by_size(&mesh), by_size(&turned));
        assert_no_crack(&mesh, &smoothed, model.name);
        let off = farthest(&smoothed, |i| other.as_slice()[i], n);
        println!("{} by size: turned {off:.1e}", model.name);
        assert!(off < 1e-9, "{}: {off:e}", model.name);
        let edit = |mesh: &Mesh<f64>| {
            let edit = ScaledCurvature::by(1.5);
            edit_detail(mesh, &Handles::new(), &edit, &DetailOptions::default()).unwrap()
        };
        let (detailed, other) = (edit(&mesh), edit(&turned));
        assert_no_crack(&mesh, &detailed, model.name);
        let off = farthest(&detailed, |i| other.as_slice()[i], n);
        println!("{}: detail, turned {off:.1e}", model.name);
        assert!(off < 1e-9, "{}: {off:e}", model.name);
    }
}

#[test]
fn rules_that_need_normals_refuse_by_name() {
    let mesh = book(3).mesh();
    let handles = Handles::new().fix([VertexId::new(0)]);
    for orientation in [
        OrientationKind::Reflect,
        OrientationKind::Limited,
        OrientationKind::LimitedMagnitude,
        OrientationKind::ReflectFirst,
    ] {
        let options = DeformOptions::default().orientation(orientation);
        let error = deform(&mesh, &handles, &options).unwrap_err().to_string();
        assert!(error.contains("one oriented surface"), "{error}");
    }
    let tutte = DeformOptions::default().scheme(SchemeKind::Tutte);
    let error = deform(&mesh, &handles, &tutte).unwrap_err().to_string();
    assert!(error.contains("Tutte scheme"), "{error}");
    for scheme in [
        SchemeKind::Uniform,
        SchemeKind::EdgeLength,
        SchemeKind::Clamped,
    ] {
        let options = DeformOptions::default().scheme(scheme);
        let _ = deform(&mesh, &handles, &options).unwrap();
    }
}

#[test]
fn a_torus_with_its_faces_turned_is_the_torus() {
    let shape = torus::<f64>(1.0, 0.4, 24, 12);
    let model = Model::glued("torus", &triangles_of(&shape, [0.0; 3]));
    let mesh = model.mesh();
    let same: Vec<usize> = (0..model.positions.len()).collect();
    let handles = handles(&model, &same, Isometry3::identity(), motion());
    let turned = model.turned(5).mesh();
    assert!(!turned.connectivity().has_copies());
    let (a, b) = (deformed(&mesh, &handles), deformed(&turned, &handles));
    let off = farthest(&a, |i| b.as_slice()[i], same.len());
    assert!(off < 1e-9, "{off:e}");
}
