//! Prints a fingerprint of the positions and the number of iterations of 336 runs: jobs, options,
//! meshes and both scalar types.
//!
//! A change that must not change results prints the same lines before and after, with the same
//! profile:
//!
//! ```text
//! cargo run -p cotan-tests --example recorded_runs > before.txt
//! cargo run -p cotan-tests --example recorded_runs > after.txt
//! diff before.txt after.txt
//! ```
//!
//! The models are skipped if they are not next to the project; the generated shapes always run.

use cotan::prelude::*;
use cotan::reconstruct;
use cotan::smooth::{
    DetailOptions, ScaledCurvature, SmoothMethod, SmoothOptions, edit_detail, smooth,
};
use cotan::sphere::{SphereMethod, SphereOptions, spherical};
use cotan_geometry::shapes::{bar, creature, torus};

fn main() {
    record("bar", &bar::<f64>([4.0, 1.0, 1.0], [24, 6, 6]));
    record("torus", &torus::<f64>(1.0, 0.35, 40, 20));
    record("creature", &creature::<f64>(40));
    for name in ["spot.obj", "fandisk.obj", "dinosaur.obj", "camelhead.off"] {
        if let Some(model) = cotan_tests::model(name) {
            let shape = Mesh::assume_checked(model.mesh().clone(), model.positions().clone());
            record(name, &shape);
        }
    }
}

fn record(name: &str, shape: &Mesh<f64>) {
    record_in(&format!("{name} f64"), shape.surface());
    let single = shape.positions().map(|p| p.map(|x| x as f32));
    let single = Surface::assume_checked(shape.connectivity(), &single);
    record_in(&format!("{name} f32"), single);
}

fn record_in<T: Scalar>(name: &str, surface: Surface<'_, T>) {
    let positions = surface.positions();
    for (options_name, options) in deformations() {
        for (handles_name, handles) in [("points", points(positions)), ("ends", ends(positions))] {
            let run =
                deform(surface, &handles, &options).map(|d| (d.positions, d.report.iterations));
            print_line(name, &format!("deform {options_name} {handles_name}"), run);
        }
    }
    let options = DeformOptions::default().iteration_limit(40);
    let run = reconstruct(surface, &ends(positions), &options)
        .map(|d| (d.positions, d.report.iterations));
    print_line(name, "reconstruct", run);
    for method in SmoothMethod::ALL {
        let options = SmoothOptions::default().method(*method);
        let run = smooth(surface, &Handles::new(), &options).map(|s| (s.positions, s.iterations));
        print_line(name, &format!("smooth {}", method.name()), run);
    }
    let edit = ScaledCurvature::by(1.5);
    let options = DetailOptions::default();
    let run = edit_detail(surface, &Handles::new(), &edit, &options)
        .map(|positions| (positions, options.iterations));
    print_line(name, "detail", run);
    for (options_name, options) in spheres() {
        let run = spherical(surface, &options).map(|s| {
            let iterations = s.report.iterations;
            (s.map.into_positions(), iterations)
        });
        print_line(name, &format!("sphere {options_name}"), run);
    }
}

fn deformations() -> Vec<(&'static str, DeformOptions)> {
    let of = |orientation| DeformOptions::default().orientation(orientation);
    let rescaled = DeformOptions::default().detail_size(DetailSize::Rescale);
    vec![
        ("hybrid", DeformOptions::default()),
        ("hybrid rescaled", rescaled),
        ("rotation", of(OrientationKind::Rotation)),
        ("limited", of(OrientationKind::Limited)),
        ("paper", DeformOptions::paper()),
    ]
}

fn spheres() -> Vec<(&'static str, SphereOptions)> {
    let authalic = SphereOptions::default().authalic(1.0);
    let cmcf = SphereOptions::default().method(SphereMethod::Cmcf);
    vec![
        ("robust", SphereOptions::default()),
        ("authalic", authalic),
        ("cmcf", cmcf),
        ("paper", SphereOptions::paper(SchemeKind::Tutte)),
    ]
}

/// The vertices sorted by x.
fn by_x<T: Scalar>(positions: &Positions<T>) -> Vec<VertexId> {
    let mut vertices: Vec<VertexId> = positions.iter().map(|(v, _)| v).collect();
    vertices.sort_by(|a, b| {
        let (a, b) = (positions[*a].x.as_f64(), positions[*b].x.as_f64());
        a.total_cmp(&b)
    });
    vertices
}

/// Four single vertices, one of them moved by a tenth of the size.
fn points<T: Scalar>(positions: &Positions<T>) -> Handles<T> {
    let vertices = by_x(positions);
    let last = vertices.len() - 1;
    let (first, end) = (vertices[0], vertices[last]);
    let size = positions[end].x - positions[first].x;
    let moved = positions[end] + Vector3::new(T::zero(), size * T::of_f64(0.1), T::zero());
    Handles::new()
        .fix([first, vertices[last / 3], vertices[last / 2]])
        .move_to(end, moved)
}

/// A tenth of the vertices at one end fixed, a tenth at the other rotated by 40° and lifted.
fn ends<T: Scalar>(positions: &Positions<T>) -> Handles<T> {
    let vertices = by_x(positions);
    let tenth = (vertices.len() / 10).max(3);
    let (low, high) = (&vertices[..tenth], &vertices[vertices.len() - tenth..]);
    let pivot = positions[high[0]].coords;
    let turn = Isometry3::rotation(Vector3::new(T::zero(), T::zero(), T::of_f64(0.7)));
    let lift = Vector3::new(T::zero(), pivot.norm() * T::of_f64(0.1), T::zero());
    let matrix = Matrix4::new_translation(&(pivot + lift))
        * turn.to_homogeneous()
        * Matrix4::new_translation(&-pivot);
    Handles::new()
        .fix(low.iter().copied())
        .transform(high.iter().copied(), matrix)
}

fn print_line<T: Scalar, E: std::fmt::Display>(
    mesh: &str,
    job: &str,
    run: Result<(Positions<T>, usize), E>,
) {
    match run {
        Ok((positions, iterations)) => println!(
            "{mesh} | {job} | {:016x} | {iterations} | {}",
            fingerprint(&positions),
            summary(&positions),
        ),
        Err(error) => println!("{mesh} | {job} | refused: {error}"),
    }
}

/// FNV-1a of the bits of all coordinates.
fn fingerprint<T: Scalar>(positions: &Positions<T>) -> u64 {
    let coordinates = positions.values().flat_map(|p| [p.x, p.y, p.z]);
    let bytes = coordinates.flat_map(|x| x.as_f64().to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// The root mean square of the coordinates to eight digits, to show the size of a difference.
fn summary<T: Scalar>(positions: &Positions<T>) -> String {
    let squares = positions
        .values()
        .map(|p| p.coords.map(T::as_f64).norm_squared());
    let mean = squares.sum::<f64>() / positions.len() as f64;
    format!("{:.8}", mean.sqrt())
}
