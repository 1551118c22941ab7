//! Smoothing by size, measured: transfer of waves on spheres, nine models by six sizes, and time.
//! The tables of `docs/decisions/2026-11-30-smoothing-by-size.md`.
//!
//! ```sh
//! cargo run --release -p cotan-tests --example size_table -- [TABLE]
//! ```
//!
//! with TABLE one of transfer, bumps, resolution, scan, models, time; all without it.

use std::time::Instant;

use cotan::linear::{Bilaplacian, BilaplacianSystem, Strategy, SystemOptions};
use cotan::prelude::*;
use cotan::shapes::{VertexOrder, icosphere, irregular};
use cotan::smooth::{BumpSize, BySizeOptions, Displacement, SmoothBySize};
use cotan_tests::model;

fn main() {
    let wanted = std::env::args().nth(1);
    let is_wanted = |name: &str| wanted.as_deref().is_none_or(|w| w == name);
    if is_wanted("transfer") {
        transfer();
    }
    if is_wanted("bumps") {
        bumps();
    }
    if is_wanted("resolution") {
        resolution();
    }
    if is_wanted("scan") {
        scan();
    }
    if is_wanted("models") {
        models();
    }
    if is_wanted("time") {
        times();
    }
}

const SIZES: [f64; 9] = [0.02, 0.05, 0.08, 0.1, 0.15, 0.2, 0.25, 0.35, 0.5];

/// The share of a spherical harmonic that is kept on a unit sphere, against 1 − B².
fn transfer() {
    let on_sphere = |shape: Mesh<f64>| {
        let round = shape
            .positions()
            .map(|p| Point3::from(p.coords.normalize()));
        shape.with_positions(round).expect("a sphere")
    };
    let spheres = [
        ("geodesic 10k", icosphere::<f64>(5)),
        ("geodesic 41k", icosphere::<f64>(6)),
        (
            "irregular 15k",
            on_sphere(irregular(15_000, VertexOrder::Natural, 3)),
        ),
    ];
    for degree in [6, 40] {
        print!("\n| degree {degree}, s = |");
        SIZES.iter().for_each(|s| print!(" {s} |"));
        print!("\n|---|{}\n| theory |", "---|".repeat(SIZES.len()));
        for s in SIZES {
            // The diameter is 1 in units of the size.
            let eigenvalue = 4.0 * f64::from(degree * (degree + 1));
            let mu = (std::f64::consts::PI / s).powi(2) / 1.55;
            let b = eigenvalue.powi(2) / (eigenvalue.powi(2) + mu * mu);
            print!(" {:.3} |", 1.0 - b * b);
        }
        for (name, sphere) in &spheres {
            print!("\n| {name} |");
            let wave = |p: &Point3<f64>| nalgebra::Complex::new(p.x, p.y).powi(degree).re;
            let height = 0.05 / f64::from(degree * degree);
            let bumpy = sphere.positions().map(|p| p * (1.0 + height * wave(p)));
            let areas = sphere.surface().dual_areas();
            let part = |x: &Positions<f64>| -> f64 {
                let pairs = x
                    .iter()
                    .map(|(v, p)| p.coords.norm() * areas[v] * wave(&sphere.positions()[v]));
                pairs.sum()
            };
            let before = part(&bumpy);
            let mean = part(sphere.positions());
            let mut job = job(&sphere.surface().with_positions(&bumpy));
            for s in SIZES {
                let smoothed = job.smooth(&BumpSize::Share(s)).expect("spheres smooth");
                print!(
                    " {:.3} |",
                    (part(&smoothed.positions) - mean) / (before - mean)
                );
            }
        }
    }
    println!();
}

/// The height kept of one round bump (a raised cosine of diameter D) on a plane.
fn bumps() {
    println!("\n| s/D | 0.25 | 0.5 | 0.75 | 1 | 1.5 | 2 |\n|---|---|---|---|---|---|---|");
    print!("| kept |");
    let flat = cotan::shapes::bumpy_plane::<f64>([1.0, 1.0], [160, 160], 0.0);
    let diameter = 0.1;
    let centre = flat.surface().bounding_box().center();
    let height = |p: &Point3<f64>| {
        let r = (p - centre).norm() / diameter;
        0.01 * diameter
            * if r < 0.5 {
                0.5 + 0.5 * (2.0 * std::f64::consts::PI * r).cos()
            } else {
                0.0
            }
    };
    let x = flat.positions().map(|p| p + Vector3::z() * height(p));
    let top = |x: &Positions<f64>| x.values().map(|p| p.z).fold(f64::MIN, f64::max);
    let surface = flat.surface();
    let mut job = job(&surface.with_positions(&x));
    for ratio in [0.25, 0.5, 0.75, 1.0, 1.5, 2.0] {
        let smoothed = job
            .smooth(&BumpSize::Length(ratio * diameter))
            .expect("smooths");
        print!(" {:.2} |", top(&smoothed.positions) / top(&x));
    }
    println!();
}

/// The dinosaur, and the same surface with each triangle split into four: how much the motions of
/// the common vertices differ.
fn resolution() {
    let Some(mesh) = model("dinosaur.obj") else {
        return;
    };
    let coarse = mesh.surface();
    let (points, triangles) = split(&coarse);
    let fine = Mesh::from_triangles(&points, &triangles).expect("a surface");
    println!("\n| s % | difference of the motions, % |\n|---|---|");
    for percent in [2.0, 5.0, 10.0] {
        let size = BumpSize::Share(0.01 * percent);
        let smooth = |surface: &Surface<'_, f64>| {
            job(surface).smooth(&size).expect("models smooth").positions
        };
        let (a, b) = (smooth(&coarse), smooth(&fine.surface()));
        let (mut off, mut motion) = (0.0, 0.0);
        for (v, p) in a.iter() {
            off += (p - b[v]).norm_squared();
            motion += (p - coarse.position(v)).norm_squared();
        }
        println!("| {percent} | {:.2} |", 100.0 * f64::sqrt(off / motion));
    }
}

/// Each triangle as four; the vertices come first.
fn split(surface: &Surface<'_, f64>) -> (Vec<[f64; 3]>, Vec<u32>) {
    let mesh = surface.mesh();
    let n = mesh.num_vertices() as u32;
    let mut points: Vec<[f64; 3]> = surface
        .positions()
        .values()
        .map(|p| [p.x, p.y, p.z])
        .collect();
    for e in mesh.edges() {
        let [a, b] = mesh.edge_vertices(e).map(|v| surface.position(v));
        let m = nalgebra::center(&a, &b);
        points.push([m.x, m.y, m.z]);
    }
    let mut triangles = Vec::new();
    for f in mesh.faces() {
        let sides: Vec<_> = mesh.face_halfedges(f).collect();
        let corner = |k: usize| mesh.origin(sides[k]).index() as u32;
        let middle = |k: usize| n + sides[k].edge().index() as u32;
        for k in 0..3 {
            triangles.extend([corner(k), middle(k), middle((k + 2) % 3)]);
        }
        triangles.extend([middle(0), middle(1), middle(2)]);
    }
    (points, triangles)
}

/// 437,000 vertices in 150 bodies, on one thread.
fn scan() {
    let body = irregular::<f64>(2_913, VertexOrder::Natural, 11);
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for k in 0..150 {
        let first = points.len() as u32;
        let (x, y) = (f64::from(k % 15), f64::from(k / 15));
        let size = 0.1 + 0.3 * (f64::from(k) * 0.618).fract();
        let placed = body.to_positions::<f64>();
        points.extend(
            placed
                .iter()
                .map(|p| [size * p[0] + x, size * p[1] + y, size * p[2]]),
        );
        triangles.extend(body.to_triangles().iter().map(|v| v + first));
    }
    let mesh = Mesh::from_triangles(&points, &triangles).expect("a surface");
    cotan_parallel::on_threads(1, || {
        let surface = mesh.surface();
        let operator = Operator::assemble(&ClampedCotangent::default(), &surface).expect("weights");
        let diagonal: Vec<f64> = surface.dual_areas().values().map(|m| 1e4 * m).collect();
        let clock = Instant::now();
        LinearSystem::screened(&operator, &diagonal, &[]).expect("a matrix");
        let factor = clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        job(&surface).smooth(&BumpSize::Share(0.005)).expect("smooths");
        let seconds = clock.elapsed().as_secs_f64();
        println!(
            "\n{} vertices: {seconds:.2} s, {:.1} times the factorization of S + μm ({factor:.2} s)",
            mesh.num_vertices(),
            seconds / factor
        );
    })
    .expect("a thread");
    if let Ok(status) = std::fs::read_to_string("/proc/self/status") {
        let peak = status.lines().find(|line| line.starts_with("VmHWM"));
        println!("{}", peak.unwrap_or_default());
    }
}

fn job(surface: &Surface<'_, f64>) -> SmoothBySize<f64> {
    SmoothBySize::new(*surface, &Handles::new(), &BySizeOptions::default()).expect("a surface")
}

fn models() {
    println!(
        "\n| model, s % | dihedral rms | volume | rms motion % | drift % | self-intersecting | kept | solves | s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let names = [
        "dinosaur.obj",
        "armadillo.ply",
        "igea.ply",
        "fandisk_noisy.obj",
        "cartoon_elephant.obj",
        "camelhead.off",
        "venus_33587_derived.ply",
        "spot.obj",
        "brain.ply",
    ];
    for name in names {
        let Some(mesh) = model(name) else { continue };
        let rest = mesh.surface();
        let size = rest.bounding_box().longest_side();
        let crossings = |s: &Surface<'_, f64>| s.self_intersections().len();
        println!("| {name} | | | | | {} | | | |", crossings(&rest));
        let mut job = job(&rest);
        for percent in [0.2, 0.5, 1.0, 2.0, 5.0, 10.0] {
            let clock = Instant::now();
            let smoothed = job
                .smooth(&BumpSize::Share(0.01 * percent))
                .expect("models smooth");
            let seconds = clock.elapsed().as_secs_f64();
            let after = rest.with_positions(&smoothed.positions);
            let volume = match mesh.mesh().is_closed() {
                true => format!("{:.4}", after.volume() / rest.volume()),
                false => "–".into(),
            };
            println!(
                "| {percent} | {:.3} | {volume} | {:.3} | {:.3} | {} | {} | {} | {seconds:.2} |",
                dihedral_rms(&after) / dihedral_rms(&rest),
                100.0 * Displacement::measure(&rest, &after).rms / size,
                100.0 * drift(&rest, &smoothed.positions) / size,
                crossings(&after),
                smoothed.kept_vertices,
                smoothed.solves,
            );
        }
    }
}

/// Root mean square of the dihedral angles, weighted by edge length.
fn dihedral_rms(surface: &Surface<'_, f64>) -> f64 {
    let mesh = surface.mesh();
    let normals = surface.face_normals();
    let (mut sum, mut total) = (0.0, 0.0);
    for (e, length) in surface.edge_lengths().iter() {
        let [a, b] = e.halfedges().map(|h| mesh.face(h));
        if let (Some(a), Some(b)) = (a, b) {
            sum += length * cotan_geometry::angle_between(&normals[a], &normals[b]).powi(2);
            total += length;
        }
    }
    (sum / total).sqrt()
}

/// Root mean square of the motion without its parts narrower than a quarter of the size.
fn drift(rest: &Surface<'_, f64>, moved: &Positions<f64>) -> f64 {
    let operator = Operator::assemble(&ClampedCotangent::default(), rest).expect("weights");
    let size = rest.bounding_box().longest_side();
    let masses: Vec<f64> = rest.dual_areas().into_vec();
    let least = 1e-3 * masses.iter().sum::<f64>() / masses.len() as f64;
    let masses: Vec<f64> = masses.iter().map(|m| m.max(least)).collect();
    let mu = 2.0 * (std::f64::consts::PI / (0.25 * size)).powi(2) / 1.55;
    let diagonal: Vec<f64> = masses.iter().map(|m| mu * mu * m).collect();
    let equation = Bilaplacian {
        operator: &operator,
        masses: &masses,
        without_row: &vec![false; masses.len()],
        diagonal: &diagonal,
        fixed: &[],
    };
    let system = BilaplacianSystem::prepare(&equation, SystemOptions::new()).expect("a matrix");
    let moves = moved.values().zip(rest.positions().values());
    let rhs: Vec<_> = moves
        .zip(&diagonal)
        .map(|((a, b), d)| (a - b) * *d)
        .collect();
    let mut x = vec![Vector3::zeros(); rhs.len()];
    system.solve(&rhs, &mut x, 1e-6).expect("converges");
    let pairs = x.iter().zip(&masses);
    let sum: f64 = pairs.map(|(x, m)| x.norm_squared() * m).sum();
    (sum / masses.iter().sum::<f64>()).sqrt()
}

/// Times on one thread, the first against one factorization of A.
fn times() {
    println!("\n| vertices | factor of A, s | direct | iterative, s | another size |");
    println!("|---|---|---|---|---|");
    for vertices in [1_000, 4_000, 10_000, 43_000, 134_000] {
        cotan_parallel::on_threads(1, || {
            let shape = irregular::<f64>(vertices, VertexOrder::Natural, 5);
            let surface = shape.surface();
            let run = |strategy| {
                let options = BySizeOptions::default().strategy(strategy);
                let clock = Instant::now();
                let mut job =
                    SmoothBySize::new(surface, &Handles::new(), &options).expect("a surface");
                job.smooth(&BumpSize::Share(0.02)).expect("smooths");
                let first = clock.elapsed().as_secs_f64();
                let clock = Instant::now();
                job.smooth(&BumpSize::Share(0.03)).expect("smooths");
                (first, clock.elapsed().as_secs_f64())
            };
            let factor = factorization(&surface);
            let (direct, _) = run(Strategy::Normal);
            let (iterative, again) = run(Strategy::Iterative);
            println!(
                "| {vertices} | {factor:.3} | {direct:.3} | {iterative:.3} ({:.2}) | {again:.3} |",
                iterative / factor
            );
        })
        .expect("a thread");
    }
}

/// Seconds of a preparation with [`Strategy::Normal`].
fn factorization(surface: &Surface<'_, f64>) -> f64 {
    let operator = Operator::assemble(&ClampedCotangent::default(), surface).expect("weights");
    let masses: Vec<f64> = surface.dual_areas().into_vec();
    let diagonal: Vec<f64> = masses.iter().map(|m| 1e6 * m).collect();
    let equation = Bilaplacian {
        operator: &operator,
        masses: &masses,
        without_row: &vec![false; masses.len()],
        diagonal: &diagonal,
        fixed: &[],
    };
    let clock = Instant::now();
    let options = SystemOptions::new().strategy(Strategy::Normal);
    BilaplacianSystem::prepare(&equation, options).expect("a matrix");
    clock.elapsed().as_secs_f64()
}
