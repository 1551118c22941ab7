//! Denoising of constructed parts: exact ones stay as they are, noisy ones keep their creases.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::f64::consts::TAU;

use cotan::prelude::*;
use cotan::smooth::{Decision, NormalError, SmoothOptions, Smoother, smooth, with_normal_noise};

/// Points and triangles under construction.
#[derive(Default)]
struct Part {
    points: Vec<[f64; 3]>,
    triangles: Vec<u32>,
}

impl Part {
    fn point(&mut self, x: f64, y: f64, z: f64) -> u32 {
        self.points.push([x, y, z]);
        self.points.len() as u32 - 1
    }

    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangles.extend([a, b, c, a, c, d]);
    }

    /// The quads between two closed rows of points.
    fn strip(&mut self, low: &[u32], high: &[u32]) {
        let n = low.len();
        for i in 0..n {
            let j = (i + 1) % n;
            self.quad([low[i], low[j], high[j], high[i]]);
        }
    }

    fn build(self) -> Mesh<f64> {
        Mesh::from_triangles(&self.points, &self.triangles).unwrap()
    }
}

/// A closed cross-section of points (radius, height), swept around the z axis along a plan: for
/// each direction, the factors of the radii.
fn swept(section: &[[f64; 2]], plan: &[[f64; 2]]) -> Mesh<f64> {
    let mut part = Part::default();
    let rows: Vec<Vec<u32>> = section
        .iter()
        .map(|[r, z]| {
            plan.iter()
                .map(|[x, y]| part.point(r * x, r * y, *z))
                .collect()
        })
        .collect();
    for (k, row) in rows.iter().enumerate() {
        part.strip(row, &rows[(k + 1) % rows.len()]);
    }
    part.build()
}

fn circle(n: usize) -> Vec<[f64; 2]> {
    (0..n)
        .map(|i| TAU * i as f64 / n as f64)
        .map(|a| [a.cos(), a.sin()])
        .collect()
}

/// A prism over a convex plan, with all diagonals of a cap from one corner.
fn prism(plan: &[[f64; 2]], height: f64) -> Mesh<f64> {
    let mut part = Part::default();
    let mut row =
        |z: f64| -> Vec<u32> { plan.iter().map(|[x, y]| part.point(*x, *y, z)).collect() };
    let (low, high) = (row(0.0), row(height));
    part.strip(&low, &high);
    for i in 1..plan.len() - 1 {
        part.triangles.extend([low[0], low[i + 1], low[i]]);
        part.triangles.extend([high[0], high[i], high[i + 1]]);
    }
    part.build()
}

/// A plate with a round hole, whose corners are joined to the points of the hole: long slivers.
fn block_with_hole(half: [f64; 2], height: f64, radius: f64, n: usize) -> Mesh<f64> {
    let mut part = Part::default();
    let corners = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
    let mut rings = Vec::new();
    for z in [0.0, height] {
        let outer: Vec<u32> = corners
            .iter()
            .map(|[x, y]| part.point(x * half[0], y * half[1], z))
            .collect();
        let inner: Vec<u32> = circle(n)
            .iter()
            .map(|[x, y]| part.point(radius * x, radius * y, z))
            .collect();
        rings.push((outer, inner));
    }
    let quarter = n / 4;
    for (level, (outer, inner)) in rings.iter().enumerate() {
        let mut cap = |t: [u32; 3]| {
            let [a, b, c] = t;
            part.triangles
                .extend(if level == 1 { [a, b, c] } else { [a, c, b] });
        };
        for s in 0..4 {
            let corner = outer[s];
            for k in s * quarter..(s + 1) * quarter {
                cap([corner, inner[(k + 1) % n], inner[k]]);
            }
            cap([corner, outer[(s + 1) % 4], inner[(s + 1) * quarter % n]]);
        }
    }
    let (low, high) = (rings[0].clone(), rings[1].clone());
    part.strip(&low.0, &high.0);
    part.strip(&high.1, &low.1);
    part.build()
}

/// A closed polygon of (radius, height), each side cut into pieces of at most `length`.
fn cut(section: &[[f64; 2]], length: f64) -> Vec<[f64; 2]> {
    let n = section.len();
    let mut points = Vec::new();
    for i in 0..n {
        let ([a, b], [c, d]) = (section[i], section[(i + 1) % n]);
        let pieces = ((c - a).hypot(d - b) / length).ceil().max(1.0) as usize;
        for k in 0..pieces {
            let t = k as f64 / pieces as f64;
            points.push([a + t * (c - a), b + t * (d - b)]);
        }
    }
    points
}

/// The section of a ring, from its inner to its outer radius.
fn ring(inner: f64, outer: f64, height: f64) -> Vec<[f64; 2]> {
    vec![[inner, 0.0], [outer, 0.0], [outer, height], [inner, height]]
}

/// The plan of a gear: teeth of four points each, as far as 1 + `depth`.
fn teeth(count: usize, depth: f64) -> Vec<[f64; 2]> {
    (0..4 * count)
        .map(|i| {
            let r = if i % 4 < 2 { 1.0 + depth } else { 1.0 };
            let a = TAU * i as f64 / (4 * count) as f64;
            [r * a.cos(), r * a.sin()]
        })
        .collect()
}

fn stepped() -> Vec<[f64; 2]> {
    vec![
        [0.2, 0.0],
        [1.0, 0.0],
        [1.0, 0.6],
        [0.7, 0.6],
        [0.7, 1.4],
        [0.4, 1.4],
        [0.4, 2.4],
        [0.2, 2.4],
    ]
}

fn exact_parts() -> Vec<(&'static str, Mesh<f64>)> {
    let pulley = vec![
        [0.3, 0.0],
        [1.0, 0.0],
        [0.8, 0.2],
        [0.8, 0.4],
        [1.0, 0.6],
        [0.3, 0.6],
    ];
    vec![
        (
            "block with a hole",
            block_with_hole([3.0, 2.0], 1.0, 0.6, 48),
        ),
        (
            "thin plate with a hole",
            block_with_hole([10.0, 4.0], 0.1, 2.0, 96),
        ),
        (
            "block with a tiny hole",
            block_with_hole([3.0, 3.0], 2.0, 0.05, 32),
        ),
        ("cylinder of 200 sides", prism(&circle(200), 1.0)),
        ("rod", prism(&circle(24), 30.0)),
        ("coin", prism(&circle(120), 0.02)),
        ("hexagonal prism", prism(&circle(6), 1.0)),
        ("cube of 12 triangles", prism(&circle(4), 1.4)),
        ("tube", swept(&ring(0.8, 1.0, 5.0), &circle(64))),
        ("washer", swept(&ring(0.5, 1.0, 0.05), &circle(100))),
        ("nut", swept(&ring(0.5, 1.0, 0.4), &circle(6))),
        ("gear", swept(&ring(0.4, 1.0, 0.3), &teeth(24, 0.2))),
        ("stepped shaft", swept(&stepped(), &circle(80))),
        ("pulley", swept(&pulley, &circle(90))),
        ("even bar", cotan::shapes::bar([4.0, 1.0, 1.0], [16, 4, 4])),
    ]
}

#[test]
fn nothing_moves_on_fifteen_exact_parts() {
    for (name, part) in exact_parts() {
        let surface = part.surface();
        // As a file of single precision has them, turned so that no face is along an axis.
        let turn = nalgebra::Rotation3::new(Vector3::new(0.3, 0.7, -0.2));
        let turned = part
            .positions()
            .map(|p| (turn * p).cast::<f32>().cast::<f64>());
        for positions in [part.positions(), &turned] {
            let surface = surface.with_positions(positions);
            let decision = Decision::for_surface(&surface);
            assert!(decision.is_exact(), "{name}: {}", decision.coplanar);
            let options = SmoothOptions::default();
            let smoothed = smooth(surface, &Handles::new(), &options).unwrap();
            assert_eq!(&smoothed.positions, positions, "{name}");
            assert!(smoothed.reason.unwrap().contains("exactly flat"));
        }
    }
}

#[test]
fn noisy_parts_keep_their_creases() {
    let fine = |plan: &[[f64; 2]], section: &[[f64; 2]], length: f64| {
        swept(&cut(section, length), &cut(plan, length))
    };
    let parts = [
        ("bar", cotan::shapes::bar([4.0, 2.0, 1.0], [40, 20, 10])),
        ("nut", fine(&circle(6), &ring(0.5, 1.0, 0.6), 0.06)),
        ("square tube", fine(&circle(4), &ring(0.6, 1.0, 1.0), 0.07)),
        ("stepped square", fine(&circle(4), &stepped(), 0.08)),
    ];
    for (name, part) in &parts {
        let rest = part.surface();
        assert!(Decision::for_surface(&rest).is_exact(), "{name}");
        for level in [0.05, 0.1, 0.2, 0.3] {
            let noisy = with_normal_noise(&rest, level * rest.mean_edge_length(), 5);
            let noisy = rest.with_positions(&noisy);
            let smoothed = smooth(noisy, &Handles::new(), &SmoothOptions::default()).unwrap();
            let reason = smoothed.reason.unwrap();
            assert_eq!(
                smoothed.method,
                Smoother::Feature,
                "{name} {level}: {reason}"
            );
            let error = |s: &Surface<'_, f64>| NormalError::measure(&rest, s).mean;
            let after = error(&rest.with_positions(&smoothed.positions));
            println!(
                "{name} {level}: {:.2} -> {after:.2}; {reason}",
                error(&noisy)
            );
            assert!(after < 0.4 * error(&noisy), "{name} {level}: {after}");
        }
    }
}
