//! Measurements and remeshing commute with renumbering, rigid motions and scale, on surfaces with
//! boundaries and several components.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use cotan_geometry::testing::{directions, rigid_motions, surfaces};
use cotan_geometry::{Mesh, SurfacePoint, SurfaceTree};
use cotan_halfedge::{FaceId, VertexId, VertexMap};
use cotan_surface::{
    DeviationOptions, EdgePaths, GeodesicDistances, RemeshOptions, SubdivideOptions,
    SubdivisionScheme, deviation, gaussian_curvatures, isolines, principal_curvatures, remesh,
    straight_line, subdivide,
};
use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;

/// A mesh, and the same with other indices at another place.
#[derive(Clone, Debug)]
struct Pair {
    here: Mesh<f64>,
    there: Mesh<f64>,
    /// Per vertex and per face of `here`: its index in `there`.
    vertices: Vec<usize>,
    faces: Vec<usize>,
    motion: Isometry3<f64>,
    scale: f64,
}

impl Pair {
    fn new(here: Mesh<f64>, seed: u64, motion: Isometry3<f64>, scale: f64) -> Self {
        let vertices = shuffled(here.num_vertices(), seed);
        let faces = shuffled(here.num_faces(), seed ^ 0x55);
        let mut positions = vec![[0.0; 3]; vertices.len()];
        for (v, p) in here.positions().iter() {
            let p = motion * Point3::from(p.coords * scale);
            positions[vertices[v.index()]] = p.into();
        }
        let mut corners = vec![[0; 3]; faces.len()];
        for f in here.connectivity().faces() {
            let triangle = here.connectivity().triangle(f);
            corners[faces[f.index()]] = triangle.map(|v| vertices[v.index()] as u32);
        }
        let there = Mesh::from_triangles(&positions, &corners.concat()).unwrap();
        Self {
            here,
            there,
            vertices,
            faces,
            motion,
            scale,
        }
    }

    fn vertex(&self, v: VertexId) -> VertexId {
        VertexId::new(self.vertices[v.index()])
    }

    fn place(&self, p: &Point3<f64>) -> Point3<f64> {
        self.motion * Point3::from(p.coords * self.scale)
    }

    /// A size of the numbers that are rounded.
    fn size(&self) -> f64 {
        let numbers = self.there.positions().values().map(|p| p.coords.amax());
        numbers.fold(self.there.surface().bounding_box().diagonal(), f64::max)
    }
}

/// Two surfaces side by side, closed or open, without four points on a circle or two edges of the
/// same length: with such ties the numbering decides.
fn pairs() -> impl Strategy<Value = Pair> {
    let scales = (-1.0..1.0_f64).prop_map(|exponent| 10.0_f64.powf(exponent));
    (
        surfaces(),
        surfaces(),
        any::<u64>(),
        rigid_motions(),
        scales,
    )
        .prop_map(|(one, two, seed, motion, scale)| {
            let mut positions = one.to_positions::<f64>();
            let mut corners = one.to_triangles();
            let (box_one, box_two) = (one.surface().bounding_box(), two.surface().bounding_box());
            let shift = box_one.max + Vector3::repeat(box_one.diagonal()) - box_two.min;
            corners.extend(
                two.to_triangles()
                    .iter()
                    .map(|v| v + positions.len() as u32),
            );
            positions.extend(
                two.positions()
                    .values()
                    .map(|p| <[f64; 3]>::from(p + shift)),
            );
            let shortest = |mesh: &Mesh<f64>| {
                let lengths = mesh.surface().edge_lengths();
                lengths.values().fold(f64::INFINITY, |m, l| m.min(*l))
            };
            let reach = 0.05 * shortest(&one).min(shortest(&two));
            let mut random = Random(seed);
            for x in positions.iter_mut().flatten() {
                *x += reach * random.share();
            }
            let mesh = Mesh::from_triangles(&positions, &corners).unwrap();
            Pair::new(mesh, seed, motion, scale)
        })
}

struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn share(&mut self) -> f64 {
        self.next() as f64 / u64::MAX as f64
    }
}

fn shuffled(count: usize, seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    let mut random = Random(seed);
    for i in (1..count).rev() {
        order.swap(i, (random.next() % (i as u64 + 1)) as usize);
    }
    order
}

const SCHEMES: [SubdivisionScheme; 3] = [
    SubdivisionScheme::Loop,
    SubdivisionScheme::CatmullClark,
    SubdivisionScheme::Midpoint,
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn distances_along_the_surface_commute(pair in pairs(), source in any::<prop::sample::Index>()) {
        let source = VertexId::new(source.index(pair.here.num_vertices()));
        let heat = |mesh: &Mesh<f64>, v| {
            GeodesicDistances::new(mesh).unwrap().from_vertices(&[v]).unwrap()
        };
        let edges = |mesh: &Mesh<f64>, v| EdgePaths::from(mesh, &[v]).distances().clone();
        let here = [heat(&pair.here, source), edges(&pair.here, source)];
        let there = [pair.vertex(source); 2];
        let there = [heat(&pair.there, there[0]), edges(&pair.there, there[1])];
        for ((before, after), tolerance) in here.iter().zip(&there).zip([1e-4, 1e-12]) {
            for (v, d) in before.iter() {
                let other = after[pair.vertex(v)];
                prop_assert_eq!(d.is_finite(), other.is_finite());
                let miss = (other - d * pair.scale).abs();
                prop_assert!(!d.is_finite() || miss <= tolerance * pair.size(), "{} {}", d, other);
            }
        }
    }

    #[test]
    fn straight_lines_commute(
        pair in pairs(), direction in directions(), face in any::<prop::sample::Index>(),
    ) {
        let face = face.index(pair.here.num_faces());
        let corners = pair.here.connectivity().triangle(FaceId::new(face));
        let weights = [0.21, 0.33, 0.46];
        let other = FaceId::new(pair.faces[face]);
        let turned = pair.there.connectivity().triangle(other).map(|w| {
            let k = corners.iter().position(|&v| pair.vertex(v) == w).unwrap();
            weights[k]
        });
        let length = pair.here.surface().mean_edge_length();
        let trace = |mesh: &Mesh<f64>, face, barycentric, direction: Vector3<f64>, length| {
            straight_line(mesh, &SurfacePoint { face, barycentric }, &direction, length)
        };
        let here = trace(&pair.here, FaceId::new(face), weights, direction, length);
        let direction = pair.motion * direction;
        let there = trace(&pair.there, other, turned, direction, length * pair.scale);
        prop_assert_eq!(here.end, there.end);
        let end = pair.place(here.positions.last().unwrap());
        prop_assert!((end - there.positions.last().unwrap()).norm() < 1e-6 * pair.size());
    }

    #[test]
    fn isolines_commute(pair in pairs(), direction in directions(), share in 0.01..0.99_f64) {
        let heights = pair.here.positions().map(|p| direction.dot(&p.coords));
        let mut moved = VertexMap::filled(heights.len(), 0.0);
        for (v, h) in heights.iter() {
            moved[pair.vertex(v)] = *h;
        }
        let low = heights.values().fold(f64::INFINITY, |m, v| m.min(*v));
        let high = heights.values().fold(f64::NEG_INFINITY, |m, v| m.max(*v));
        let level = low + share * (high - low);
        let measure = |mesh: &Mesh<f64>, values| {
            let lines = isolines(mesh, values, level);
            let mut length = 0.0;
            for line in &lines {
                let ends = line.points.windows(2);
                length += ends.map(|p| (p[1] - p[0]).norm()).sum::<f64>();
                if line.is_closed {
                    length += (line.points[0] - line.points[line.points.len() - 1]).norm();
                }
            }
            let points: usize = lines.iter().map(|l| l.points.len()).sum();
            let closed = lines.iter().filter(|l| l.is_closed).count();
            ((lines.len(), closed, points), length)
        };
        let (here, there) = (measure(&pair.here, &heights), measure(&pair.there, &moved));
        prop_assert_eq!(here.0, there.0);
        let scaled = here.1 * pair.scale;
        prop_assert!((there.1 - scaled).abs() <= 1e-9 * (pair.size() + scaled));
    }

    #[test]
    fn curvatures_commute(pair in pairs()) {
        let (here, there) = (principal_curvatures(&pair.here), principal_curvatures(&pair.there));
        let (gauss, moved) = (gaussian_curvatures(&pair.here), gaussian_curvatures(&pair.there));
        for (v, a) in here.iter() {
            let b = &there[pair.vertex(v)];
            let size = 1.0 + a.curvatures[0].abs().max(a.curvatures[1].abs());
            for k in 0..2 {
                let miss = (b.curvatures[k] * pair.scale - a.curvatures[k]).abs();
                prop_assert!(miss < 1e-4 * size, "{} {:?} {:?}", v, a, b);
            }
            let k = moved[pair.vertex(v)] * pair.scale.powi(2);
            prop_assert!((k - gauss[v]).abs() < 1e-6 * (1.0 + gauss[v].abs()));
        }
    }

    #[test]
    fn deviations_commute(pair in pairs(), other in surfaces()) {
        let moved = other.with_positions(other.positions().map(|p| pair.place(p)))?;
        let options = DeviationOptions::default().samples(2000);
        let here = deviation(&pair.here, &other, &options).unwrap();
        let there = deviation(&pair.there, &moved, &options).unwrap();
        let rounding = 1e-12 * (pair.size() + there.hausdorff());
        let scale = pair.scale;
        prop_assert!(here.hausdorff() * scale <= there.hausdorff_bound() + rounding);
        prop_assert!(there.hausdorff() <= here.hausdorff_bound() * scale + rounding);
        for (v, d) in here.forth.of_vertices.iter() {
            let other = there.forth.of_vertices[pair.vertex(v)];
            prop_assert!((other - d * scale).abs() <= 100.0 * rounding);
        }
    }

    #[test]
    fn queries_commute(pair in pairs(), at in prop::array::uniform3(-0.2..1.2_f64)) {
        let bounds = pair.here.surface().bounding_box();
        let at = Vector3::from(at).component_mul(&bounds.extents());
        let point = bounds.min + at;
        let [here, there] = [&pair.here, &pair.there].map(SurfaceTree::new);
        let moved = pair.place(&point);
        let distance = here.closest(&point).distance * pair.scale;
        prop_assert!((there.closest(&moved).distance - distance).abs() <= 1e-9 * pair.size());
        let turns = here.winding_number(&point);
        // The number jumps at the surface.
        prop_assume!(distance > 1e-6 * pair.size());
        prop_assert!((there.winding_number(&moved) - turns).abs() < 1e-6);
        if pair.here.connectivity().is_closed() {
            prop_assert!((turns - turns.round()).abs() < 1e-6, "{turns}");
        }
    }

    #[test]
    fn subdivision_commutes(pair in pairs()) {
        for scheme in SCHEMES {
            let options = SubdivideOptions::new(scheme);
            let made = |mesh: &Mesh<f64>| {
                subdivide(mesh.connectivity(), mesh.positions(), &options).unwrap()
            };
            let (here, there) = (made(&pair.here), made(&pair.there));
            there.connectivity.validate().unwrap();
            let components = here.connectivity.components().count();
            prop_assert_eq!(components, there.connectivity.components().count());
            // The vertices of the original come first.
            for v in pair.here.connectivity().vertices() {
                let off = (pair.place(&here.positions[v]) - there.positions[pair.vertex(v)]).norm();
                prop_assert!(off <= 1e-12 * pair.size(), "{off:e}");
            }
        }
    }

    // Edits are made in the order of their indices, so other indices give other triangles, on the
    // same surface and of the same size.
    #[test]
    fn remeshing_gives_the_same_surface_wherever_it_lies(pair in pairs(), factor in 0.5..1.5_f64) {
        let length = factor * pair.here.surface().mean_edge_length();
        let made = |mesh: &Mesh<f64>, length| {
            remesh(&mesh.surface(), &RemeshOptions::uniform(length)).unwrap().mesh
        };
        let here = made(&pair.here, length);
        let there = made(&pair.there, length * pair.scale);
        there.connectivity().validate().unwrap();
        prop_assert_eq!(there.connectivity().genus(), here.connectivity().genus());
        let moved = here.with_positions(here.positions().map(|p| pair.place(p)))?;
        let apart = deviation(&moved, &there, &DeviationOptions::default().samples(2000)).unwrap();
        prop_assert!(apart.mean() < 0.2 * length * pair.scale, "{}", apart.mean());
    }
}
