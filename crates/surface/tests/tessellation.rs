//! Decimation, remeshing and subdivision as theorems on random surfaces.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use cotan_geometry::shapes::{VertexOrder, irregular};
use cotan_geometry::testing::{rigid_motions, surfaces};
use cotan_geometry::{Mesh, bar, bumpy_plane, folded_faces, icosphere, torus};
use cotan_halfedge::{FaceId, FaceMap, HalfedgeMesh};
use cotan_surface::{
    DecimateAttributes, DecimateOptions, Features, RemeshOptions, SubdivideOptions,
    SubdivisionScheme, decimate, interpolated, remesh, subdivide,
};
use nalgebra::Point3;
use proptest::prelude::*;

/// The Euler characteristic and the number of boundary loops of every component, sorted.
fn topology(mesh: &HalfedgeMesh) -> Vec<(i64, usize)> {
    let mut topology: Vec<_> = mesh
        .topology()
        .iter()
        .map(|c| (c.euler_characteristic(), c.num_boundary_loops))
        .collect();
    topology.sort_unstable();
    topology
}

/// Two copies of a mesh, the second moved away.
fn twice(mesh: &Mesh<f64>) -> Mesh<f64> {
    let mut positions = mesh.to_positions::<f64>();
    let count = positions.len() as u32;
    let mut triangles = mesh.to_triangles();
    let size = mesh.surface().area().sqrt();
    positions.extend_from_within(..);
    for p in &mut positions[count as usize..] {
        p[0] += 3.0 * size;
    }
    triangles.extend(mesh.to_triangles().iter().map(|v| v + count));
    Mesh::from_triangles(&positions, &triangles).unwrap()
}

/// Any connectivity with boundaries and several components, at positions of a coarse grid: many
/// coincide or are collinear.
fn crumpled() -> impl Strategy<Value = Mesh<f64>> {
    (cotan_halfedge::testing::triangle_mesh(), any::<u64>()).prop_map(|(mesh, seed)| {
        let mut state = seed | 1;
        let mut coordinate = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            f64::from((state >> 60) as u8)
        };
        let positions = mesh
            .vertices()
            .map(|_| Point3::from([(); 3].map(|()| coordinate())));
        let positions = positions.collect();
        Mesh::new(mesh, positions).unwrap()
    })
}

const SCHEMES: [SubdivisionScheme; 3] = [
    SubdivisionScheme::Loop,
    SubdivisionScheme::CatmullClark,
    SubdivisionScheme::Midpoint,
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn crumpled_meshes_stay_valid(mesh in crumpled(), share in 0.0..1.0_f64) {
        let faces = (share * mesh.num_faces() as f64) as usize;
        let small = decimate(&mesh.surface(), &DecimateOptions::to_faces(faces)).unwrap().mesh;
        small.connectivity().validate().unwrap();
        prop_assert_eq!(topology(small.connectivity()), topology(mesh.connectivity()));
        let even = remesh(&small.surface(), &RemeshOptions::uniform(1.0 + 4.0 * share)).unwrap();
        even.mesh.connectivity().validate().unwrap();
        prop_assert_eq!(topology(even.mesh.connectivity()), topology(mesh.connectivity()));
        for scheme in SCHEMES {
            let options = SubdivideOptions::new(scheme);
            let fine = subdivide(mesh.connectivity(), mesh.positions(), &options).unwrap();
            fine.connectivity.validate().unwrap();
            prop_assert_eq!(topology(&fine.connectivity), topology(mesh.connectivity()));
        }
    }

    #[test]
    fn decimation_keeps_topology_and_maps_every_vertex(mesh in surfaces(), share in 0.0..1.0_f64) {
        let mesh = twice(&mesh);
        let target = (share * mesh.num_faces() as f64) as usize;
        let made = decimate(&mesh.surface(), &DecimateOptions::to_faces(target)).unwrap();
        made.mesh.connectivity().validate().unwrap();
        prop_assert_eq!(topology(made.mesh.connectivity()), topology(mesh.connectivity()));
        prop_assert!(made.mesh.num_faces() <= mesh.num_faces());
        prop_assert_eq!(made.vertex_map.len(), mesh.num_vertices());
        for (new, &old) in made.sources.iter() {
            prop_assert_eq!(made.vertex_map[old], new);
        }
    }

    #[test]
    fn remeshing_keeps_topology(mesh in surfaces(), factor in 0.3..3.0_f64, angle in 0.3..3.0_f64) {
        let mesh = twice(&mesh);
        let length = factor * mesh.surface().mean_edge_length();
        let options = RemeshOptions::uniform(length).features(Features::creases(angle));
        let made = remesh(&mesh.surface(), &options).unwrap();
        made.mesh.connectivity().validate().unwrap();
        prop_assert_eq!(topology(made.mesh.connectivity()), topology(mesh.connectivity()));
        // The places are on the original, where attributes are interpolated.
        let x = interpolated(mesh.connectivity(), &made.places, &mesh.positions().map(|p| p.x));
        let bounds = mesh.surface().bounding_box();
        for (v, _) in x.iter() {
            prop_assert!((x[v] - made.mesh.positions()[v].x).abs() <= length);
            prop_assert!(x[v] >= bounds.min.x - 1e-9 && x[v] <= bounds.max.x + 1e-9);
        }
    }

    #[test]
    fn adaptive_remeshing_keeps_topology(mesh in surfaces(), error in 0.01..0.3_f64) {
        let mean = mesh.surface().mean_edge_length();
        let options = RemeshOptions::adaptive(error * mean, 0.3 * mean, 3.0 * mean);
        let made = remesh(&mesh.surface(), &options).unwrap();
        made.mesh.connectivity().validate().unwrap();
        prop_assert_eq!(topology(made.mesh.connectivity()), topology(mesh.connectivity()));
    }

    #[test]
    fn subdivision_commutes_with_rigid_motions(mesh in surfaces(), motion in rigid_motions()) {
        for scheme in [SubdivisionScheme::Loop, SubdivisionScheme::CatmullClark] {
            let options = SubdivideOptions::new(scheme).levels(2);
            let made = subdivide(mesh.connectivity(), mesh.positions(), &options).unwrap();
            made.connectivity.validate().unwrap();
            let moved = mesh.positions().map(|p| motion * p);
            let moved = subdivide(mesh.connectivity(), &moved, &options).unwrap();
            let size = 1.0 + mesh.positions().values().fold(0.0, |s: f64, p| s.max(p.coords.amax()));
            for (v, p) in made.positions.iter() {
                prop_assert!((motion * p - moved.positions[v]).norm() < 1e-12 * size);
            }
        }
    }

    // Edges of equal cost are chosen by their index and by rounding, so decimation commutes with
    // motions where costs differ: on an irregular sphere, exactly up to rounding.
    #[test]
    fn decimation_commutes_with_rigid_motions(motion in rigid_motions(), seed in 1..1000_u64) {
        let mesh = irregular::<f64>(300, VertexOrder::Random, seed);
        let options = DecimateOptions::to_faces(200);
        let made = decimate(&mesh.surface(), &options).unwrap();
        let moved = mesh.with_positions(mesh.positions().map(|p| motion * p)).unwrap();
        let moved = decimate(&moved.surface(), &options).unwrap();
        prop_assert_eq!(&made.vertex_map, &moved.vertex_map);
        for (v, p) in made.mesh.positions().iter() {
            prop_assert!((motion * p - moved.mesh.positions()[v]).norm() < 1e-6);
        }
    }
}

#[test]
fn scaling_by_a_power_of_two_commutes_exactly() {
    let mesh = irregular::<f64>(500, VertexOrder::Random, 7);
    let large = mesh
        .with_positions(mesh.positions().map(|p| p * 1024.0))
        .unwrap();
    let options = DecimateOptions::to_faces(300);
    let [a, b] = [&mesh, &large].map(|m| decimate(&m.surface(), &options).unwrap().mesh);
    assert_eq!(a.positions().map(|p| p * 1024.0), *b.positions());
    let length = mesh.surface().mean_edge_length();
    let a = remesh(&mesh.surface(), &RemeshOptions::uniform(length))
        .unwrap()
        .mesh;
    let b = remesh(&large.surface(), &RemeshOptions::uniform(1024.0 * length))
        .unwrap()
        .mesh;
    assert_eq!(a.positions().map(|p| p * 1024.0), *b.positions());
    assert_eq!(a.to_triangles(), b.to_triangles());
}

#[test]
fn renumbering_commutes_with_decimation() {
    let mesh = irregular::<f64>(500, VertexOrder::Random, 3);
    let count = mesh.num_vertices();
    let new_of = |v: usize| (v * 7 + 3) % count;
    assert_ne!(count % 7, 0);
    let mut positions = vec![[0.0; 3]; count];
    for (v, p) in mesh.to_positions::<f64>().into_iter().enumerate() {
        positions[new_of(v)] = p;
    }
    let triangles: Vec<u32> = mesh
        .to_triangles()
        .chunks_exact(3)
        .rev()
        .flat_map(|t| [t[1], t[2], t[0]].map(|v| new_of(v as usize) as u32))
        .collect();
    let other = Mesh::<f64>::from_triangles(&positions, &triangles).unwrap();
    let options = DecimateOptions::to_faces(250);
    let [a, b] = [&mesh, &other].map(|m| decimate(&m.surface(), &options).unwrap().mesh);
    let sorted = |mesh: &Mesh<f64>| {
        let mut points: Vec<Point3<f64>> = mesh.positions().values().copied().collect();
        points.sort_by(|p, q| p.x.total_cmp(&q.x));
        points
    };
    for (p, q) in sorted(&a).iter().zip(sorted(&b)) {
        assert!((p - q).norm() < 1e-6, "{p} {q}");
    }
}

#[test]
fn a_flat_square_becomes_two_triangles_without_moving() {
    let mesh = bumpy_plane::<f64>([2.0, 1.0], [12, 9], 0.0);
    let made = decimate(&mesh.surface(), &DecimateOptions::to_faces(2)).unwrap();
    assert_eq!(made.mesh.num_faces(), 2);
    assert!((made.mesh.surface().area() - 2.0).abs() < 1e-6);
    assert!(made.mesh.positions().values().all(|p| p.z.abs() < 1e-9));
}

/// Edges of the boundary have a halfedge in one direction only, and some lead away from the corner.
#[test]
fn an_open_surface_keeps_the_ends_of_its_creases() {
    let plane = bumpy_plane::<f64>([1.0, 1.0], [20, 20], 0.0);
    let folded = plane.positions().values();
    let folded = folded.map(|p| Point3::new(p.x, p.y, p.x.abs()));
    let roof = Mesh::new(plane.connectivity().clone(), folded.collect()).unwrap();
    let options = DecimateOptions::to_faces(8).features(Features::creases(0.5));
    let small = decimate(&roof.surface(), &options).unwrap();
    small.mesh.connectivity().validate().unwrap();
    assert!(small.mesh.num_faces() <= 8);
    for y in [-0.5, 0.5] {
        let end = Point3::new(0.0, y, 0.0);
        let at = |mesh: &Mesh<f64>| mesh.positions().values().any(|p| *p == end);
        assert!(at(&roof) && at(&small.mesh), "{end}");
    }
}

#[test]
fn an_error_bound_limits_the_distance_of_a_sphere() {
    // Its own triangles are up to 2e-4 from the sphere.
    let mesh = icosphere::<f64>(5);
    let mut last = mesh.num_faces();
    for bound in [1e-3, 3e-3, 1e-2] {
        let made = decimate(&mesh.surface(), &DecimateOptions::to_error(bound)).unwrap();
        assert!(made.error <= bound && made.mesh.num_faces() < last);
        last = made.mesh.num_faces();
        let off = |p: &Point3<f64>| (p.coords.norm() - 1.0).abs();
        assert!(made.mesh.positions().values().map(off).fold(0.0, f64::max) < 4.0 * bound);
    }
}

#[test]
fn attributes_in_the_quadric_keep_a_step_of_colour() {
    let mesh = bumpy_plane::<f64>([1.0, 1.0], [20, 20], 0.0);
    let color = mesh.positions().map(|p| if p.x > 0.0 { 1.0 } else { 0.0 });
    let options = DecimateOptions::to_faces(60)
        .attributes(DecimateAttributes::new().with(color.clone(), 1.0));
    let made = decimate(&mesh.surface(), &options).unwrap();
    assert!(made.mesh.num_faces() <= 60);
    for (v, p) in made.mesh.positions().iter() {
        let expected = f64::from(u8::from(p.x > 0.0));
        let is_near_step = p.x.abs() < 0.06;
        assert!(
            is_near_step || (made.attributes[0][v] - expected).abs() < 0.1,
            "{p}"
        );
    }
    let plain = decimate(&mesh.surface(), &DecimateOptions::to_faces(60)).unwrap();
    assert!(plain.attributes.is_empty());
}

#[test]
fn attributes_that_jump_at_a_seam_cost_nothing_there() {
    // Linear on either side of x = 0, with a jump between.
    let mesh = bumpy_plane::<f64>([2.0, 1.0], [20, 10], 0.0);
    let (faces, x) = (mesh.connectivity(), mesh.positions());
    let seam = faces.edges().filter(|&e| {
        let ends = faces.edge_vertices(e);
        ends.iter().all(|&v| x[v].x.abs() < 1e-9)
    });
    let seam: Vec<_> = seam.collect();
    assert_eq!(seam.len(), 10);
    let values = (0..mesh.num_faces()).map(|f| {
        let corners = faces.triangle(FaceId::new(f)).map(|v| x[v].x);
        let jump = if corners.iter().sum::<f64>() > 0.0 {
            10.0
        } else {
            0.0
        };
        corners.map(|x| 3.0 * x + jump)
    });
    let attributes =
        DecimateAttributes::new().with_corners(FaceMap::from_vec(values.collect()), 1.0);
    let options = DecimateOptions::to_error(1e-3)
        .features(Features::none().with_edges(seam))
        .attributes(attributes);
    let made = decimate(&mesh.surface(), &options).unwrap();
    assert!(made.mesh.num_faces() < 40, "{}", made.mesh.num_faces());
    assert!((made.mesh.surface().area() - 2.0).abs() < 1e-6);
    let crossing = made.mesh.connectivity().edges().filter(|&e| {
        let [a, b] = made.mesh.connectivity().edge_vertices(e);
        made.mesh.positions()[a].x * made.mesh.positions()[b].x < -1e-9
    });
    assert_eq!(crossing.count(), 0);
}

#[test]
fn remeshing_a_bar_keeps_its_edges_and_volume() {
    let mesh = bar::<f64>([4.0, 1.0, 1.0], [7, 3, 2]);
    let made = remesh(&mesh.surface(), &RemeshOptions::uniform(0.15))
        .unwrap()
        .mesh;
    assert!((made.surface().volume() - 4.0).abs() < 1e-9);
    assert!((made.surface().area() - 18.0).abs() < 1e-9);
    let lengths = made.surface().edge_lengths();
    let even = lengths
        .values()
        .filter(|&&l| l > 0.75 * 0.15 && l < 1.35 * 0.15)
        .count();
    assert!(
        even * 100 >= 95 * lengths.len(),
        "{even} of {}",
        lengths.len()
    );
}

#[test]
fn remeshing_a_torus_gives_even_triangles_on_it() {
    let mesh = torus::<f64>(1.0, 0.4, 80, 30);
    let length = 0.08;
    let made = remesh(&mesh.surface(), &RemeshOptions::uniform(length)).unwrap();
    let surface = made.mesh.surface();
    let least = surface.angle_statistics().min;
    assert!(least > 25.0_f64.to_radians(), "{}", least.to_degrees());
    for p in made.mesh.positions().values() {
        let ring = p.x.hypot(p.y) - 1.0;
        assert!((ring.hypot(p.z) - 0.4).abs() < 0.2 * length);
    }
    assert!(
        folded_faces(&surface, made.mesh.positions())
            .unwrap()
            .is_empty()
    );
}

#[test]
fn marked_edges_stay() {
    // The two circles that separate the upper half of a torus from the lower.
    let mesh = torus::<f64>(1.0, 0.4, 40, 20);
    let x = mesh.positions();
    let equator = mesh.connectivity().edges().filter(|&e| {
        let ends = mesh.connectivity().edge_vertices(e);
        ends.iter().all(|&v| x[v].z.abs() < 1e-9)
    });
    let equator: Vec<_> = equator.collect();
    assert_eq!(equator.len(), 80);
    let features = Features::none().with_edges(equator);
    let made = remesh(
        &mesh.surface(),
        &RemeshOptions::uniform(0.1).features(features),
    )
    .unwrap();
    let above = made.mesh.connectivity().edges().filter(|&e| {
        let [a, b] = made
            .mesh
            .connectivity()
            .edge_vertices(e)
            .map(|v| made.mesh.positions()[v].z);
        a * b < -1e-9
    });
    assert_eq!(above.count(), 0);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let mesh = irregular::<f64>(5000, VertexOrder::Random, 5);
    let length = 0.7 * mesh.surface().mean_edge_length();
    let job = || {
        let small = decimate(&mesh.surface(), &DecimateOptions::to_faces(2000))
            .unwrap()
            .mesh;
        let even = remesh(&mesh.surface(), &RemeshOptions::uniform(length))
            .unwrap()
            .mesh;
        (small, even)
    };
    let [one, three] = [1, 3].map(|n| cotan_parallel::on_threads(n, job).unwrap());
    assert_eq!(one.0.positions(), three.0.positions());
    assert_eq!(one.1.positions(), three.1.positions());
    assert_eq!(one.1.to_triangles(), three.1.to_triangles());
}

#[test]
fn single_precision_works() {
    let mesh = torus::<f32>(1.0, 0.4, 40, 20);
    let small = decimate(&mesh.surface(), &DecimateOptions::to_faces(400))
        .unwrap()
        .mesh;
    assert_eq!((small.num_faces(), small.connectivity().genus()), (400, 1));
    let even = remesh(&small.surface(), &RemeshOptions::uniform(0.1))
        .unwrap()
        .mesh;
    assert_eq!(even.connectivity().genus(), 1);
}

#[test]
fn options_out_of_range_are_refused() {
    let mesh = icosphere::<f64>(1);
    let surface = mesh.surface();
    for length in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(remesh(&surface, &RemeshOptions::uniform(length)).is_err());
    }
    assert!(remesh(&surface, &RemeshOptions::uniform(1e-9)).is_err());
    assert!(decimate(&surface, &DecimateOptions::to_error(f64::NAN)).is_err());
}
