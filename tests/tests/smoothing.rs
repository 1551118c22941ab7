//! Smoothing of real models: the reference cases of
//! `shared/reference/sphere-smoothing-public-models.json`, and the documented guarantees.

use cotan::geometry::folded_faces;
use cotan::halfedge::{HalfedgeMesh, VertexMap};
use cotan::prelude::*;
use cotan::smooth::{
    Boundary, CurvatureEdit, CurvatureField, DetailOptions, Direction, Displacement, NewFolds,
    NormalError, Preserve, ScaledCurvature, SmoothMethod, SmoothOptions, Smoother, curvature_field,
    edit_detail, smooth, with_normal_noise,
};
use cotan_tests::{model, shared};
use serde_json::Value;

fn reference(key: &str) -> Vec<Value> {
    let Some(path) = shared("reference/sphere-smoothing-public-models.json") else {
        return Vec::new();
    };
    let text = std::fs::read_to_string(path).expect("readable");
    let all: Value = serde_json::from_str(&text).expect("valid JSON");
    all[key].as_array().cloned().unwrap_or_default()
}

/// The convention of the reference: vertex mean at 0, longest side of the box 1.
fn centred(positions: &Positions<f64>) -> Positions<f64> {
    let n = positions.len() as f64;
    let mean = positions.values().map(|p| p.coords).sum::<Vector3<f64>>() / n;
    let low = positions
        .values()
        .fold(positions.as_slice()[0], |a, p| a.inf(p));
    let high = positions
        .values()
        .fold(positions.as_slice()[0], |a, p| a.sup(p));
    let size = (high - low).max();
    positions.map(|p| Point3::from((p.coords - mean) / size))
}

/// The model with this name in the reference, if we have it.
fn named(name: &str) -> Option<cotan_io::ProcessingMesh> {
    match name {
        "spot" | "fandisk" => model(&format!("{name}.obj")),
        "camelhead" => model("camelhead.off"),
        _ => {
            cotan_tests::skip(format_args!("{name} is not among the models of shared"));
            None
        }
    }
}

/// The volume of the cone over a surface with its apex at the origin, which the reference also
/// uses for open meshes.
fn cone_volume(surface: &Surface<'_, f64>) -> f64 {
    let mesh = surface.mesh();
    let cone = |f| {
        let [a, b, c] = mesh.triangle(f).map(|v| surface.position(v).coords);
        a.dot(&b.cross(&c)) / 6.0
    };
    mesh.faces().map(cone).sum()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().expect("a number")
}

fn assert_near(what: &str, ours: f64, theirs: f64, tolerance: f64) {
    assert!(
        (ours - theirs).abs() <= tolerance,
        "{what}: {ours} against {theirs}"
    );
}

fn run(mesh: &HalfedgeMesh, x: &Positions<f64>, options: SmoothOptions) -> Positions<f64> {
    smooth(Surface::assume_checked(mesh, x), &Handles::new(), &options)
        .expect("smooths")
        .positions
}

fn method_of(case: &Value) -> SmoothOptions {
    let (method, boundary) = match case["method"].as_str() {
        Some("vertex") => (SmoothMethod::Anchored, Boundary::Fixed),
        Some("edge") => (SmoothMethod::FeatureEdges, Boundary::Fixed),
        Some("taubin10") => (SmoothMethod::Taubin, Boundary::Free),
        other => panic!("no method {other:?} in the reference"),
    };
    SmoothOptions::default()
        .method(method)
        .boundary(boundary)
        .folds(NewFolds::Allow)
}

/// The root mean square distance of `x` from the surface `clean`, searched within two rings.
fn rms_from_surface(clean: &Surface<'_, f64>, x: &Positions<f64>) -> f64 {
    let mesh = clean.mesh();
    let square = |v: VertexId| {
        let mut faces = Vec::new();
        for near in mesh.one_ring(v).flat_map(|j| mesh.one_ring(j)) {
            faces.extend(mesh.vertex_faces(near));
        }
        faces.sort_unstable();
        faces.dedup();
        let to_face = |f: &cotan::halfedge::FaceId| {
            let corners = mesh.triangle(*f).map(|c| clean.position(c));
            (x[v] - closest_point(&x[v], &corners)).norm_squared()
        };
        faces.iter().map(to_face).fold(f64::INFINITY, f64::min)
    };
    let sum: f64 = mesh.vertices().map(square).sum();
    (sum / x.len() as f64).sqrt()
}

/// The point of a triangle that is closest to p (Ericson, Real-Time Collision Detection, 5.1.5).
fn closest_point(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> Point3<f64> {
    let on = |a: &Point3<f64>, b: &Point3<f64>| {
        let ab = b - a;
        let t = ((p - a).dot(&ab) / ab.norm_squared()).clamp(0.0, 1.0);
        a + ab * t
    };
    let normal = (b - a).cross(&(c - a));
    let inside = |a: &Point3<f64>, b: &Point3<f64>| (b - a).cross(&(p - a)).dot(&normal) >= 0.0;
    if inside(a, b) && inside(b, c) && inside(c, a) {
        return p - normal * ((p - a).dot(&normal) / normal.norm_squared());
    }
    let sides = [on(a, b), on(b, c), on(c, a)];
    let nearest = sides
        .into_iter()
        .min_by(|q, r| (p - q).norm_squared().total_cmp(&(p - r).norm_squared()));
    nearest.expect("three sides")
}

/// Part C of the description of the algorithm, within the tolerances stated there.
#[test]
fn the_reference_cases_are_reproduced() {
    for case in reference("smooth") {
        let name = case["mesh"].as_str().expect("a name");
        let Some(mesh) = named(name) else { continue };
        let (connectivity, clean) = (mesh.mesh(), centred(mesh.positions()));
        let rest = Surface::new(connectivity, &clean).expect("a surface");
        let edge = rest.mean_edge_length();
        let noise = number(&case, "noise");
        let noisy = with_normal_noise(&rest, noise * edge, 1);
        let x = run(connectivity, &noisy, method_of(&case));
        let what = format!("{name} {} noise {noise}", case["method"]);
        let smoothed = rest.with_positions(&x);
        let tolerance = |key: &str, default| case["tolerance"][key].as_f64().unwrap_or(default);
        let ratio = cone_volume(&smoothed) / cone_volume(&rest);
        assert_near(
            &format!("{what}, volume"),
            ratio,
            number(&case, "volume_ratio"),
            tolerance("volume_ratio", 5e-4),
        );
        assert_near(
            &format!("{what}, rms"),
            rms_from_surface(&rest, &x) / edge,
            number(&case, "rms_edges"),
            tolerance("rms_edges", 2e-3),
        );
        if noise > 0.0 {
            let error = NormalError::measure(&rest, &smoothed).area_weighted;
            let theirs = number(&case, "normal_err_deg");
            assert_near(
                &format!("{what}, normals"),
                error,
                theirs,
                tolerance("normal_err_deg", 0.05),
            );
            let first = x.as_slice()[0];
            for (k, theirs) in cotan_tests::numbers(&case["X0"]).into_iter().enumerate() {
                assert_near(&format!("{what}, first vertex"), first[k], theirs, 2e-6);
            }
        }
    }
}

/// The paper's scaling of the whole vector along the normal, compared with the reference.
#[test]
fn exaggeration_matches_the_reference() {
    for case in reference("rebuild") {
        let Some(mesh) = named(case["mesh"].as_str().expect("a name")) else {
            continue;
        };
        let (connectivity, clean) = (mesh.mesh(), centred(mesh.positions()));
        let rest = Surface::new(connectivity, &clean).expect("a surface");
        let options = DetailOptions::default().direction(Direction::NormalAlone);
        let edit = ScaledCurvature::by(number(&case, "alpha"));
        let x = edit_detail(
            Surface::assume_checked(connectivity, &clean),
            &Handles::new(),
            &edit,
            &options,
        )
        .expect("runs");
        let rough = |x: &Positions<f64>| {
            let angles = rest.with_positions(x).dihedral_angles();
            let lengths = rest.edge_lengths();
            let pairs = angles.values().zip(lengths.values());
            let sum: f64 = pairs.map(|(a, l)| l * a * a).sum();
            (sum / lengths.values().sum::<f64>()).sqrt().to_degrees()
        };
        assert_near("rough_in", rough(&clean), number(&case, "rough_in"), 1e-3);
        let expected = number(&case, "rough_out");
        assert_near("rough_out", rough(&x), expected, 0.01 * expected);
        let ratio = rest.with_positions(&x).volume() / rest.volume();
        assert_near("volume", ratio, number(&case, "volume_ratio"), 1e-3);
    }
}

/// Ten iterations at s = 1 on clean models, without and with the exact correction.
#[test]
fn volume_changes_by_less_than_a_percent_or_not_at_all() {
    for name in ["dinosaur.obj", "fandisk.obj", "venus_50002.off"] {
        let Some(mesh) = model(name) else { continue };
        let (connectivity, x) = (mesh.mesh(), mesh.positions());
        let rest = Surface::new(connectivity, x).expect("a surface");
        for method in [
            SmoothMethod::Auto,
            SmoothMethod::Curvature,
            SmoothMethod::Anchored,
            SmoothMethod::Feature,
            SmoothMethod::FeatureEdges,
        ] {
            let options = SmoothOptions::default().method(method).iterations(Some(10));
            let ratio = |options| {
                let x = run(connectivity, x, options);
                rest.with_positions(&x).volume() / rest.volume()
            };
            let plain = ratio(options);
            assert!(
                (plain - 1.0).abs() < 0.01,
                "{name} {}: {plain}",
                method.name()
            );
            let kept = ratio(options.preserve(Preserve::Volume));
            assert!(
                (kept - 1.0).abs() < 1e-9,
                "{name} {}: {kept}",
                method.name()
            );
        }
    }
}

/// The goal for CAD parts: at most 3° where the noisy mesh has 28.4°, with the method chosen
/// automatically.
#[test]
fn the_noisy_fandisk_is_cleaned() {
    let (Some(clean), Some(noisy)) = (model("fandisk.obj"), model("fandisk_noisy.obj")) else {
        return;
    };
    let rest = Surface::new(clean.mesh(), clean.positions()).expect("a surface");
    let options = SmoothOptions::default();
    let smoothed = smooth(
        Surface::assume_checked(clean.mesh(), noisy.positions()),
        &Handles::new(),
        &options,
    )
    .expect("smooths");
    assert_eq!(smoothed.method, Smoother::Feature);
    let error = |x: &Positions<f64>| NormalError::measure(&rest, &rest.with_positions(x)).mean;
    assert!((error(noisy.positions()) - 28.4).abs() < 0.1);
    assert!(
        error(&smoothed.positions) <= 3.0,
        "{}",
        error(&smoothed.positions)
    );
}

/// Open boundaries, high genus and slivers: the results are finite without new flips.
#[test]
fn hard_meshes_are_smoothed_without_flips() {
    for name in [
        "camelhead.off",
        "bun_zipper.ply",
        "soccerball.obj",
        "cartoon_elephant.obj",
    ] {
        let Some(mesh) = model(name) else { continue };
        let rest = Surface::new(mesh.mesh(), mesh.positions()).expect("a surface");
        for boundary in [Boundary::Fixed, Boundary::Free] {
            let options = SmoothOptions::default()
                .boundary(boundary)
                // The needles of the elephant flip if the correction ignores them.
                .preserve(Preserve::Volume);
            let x = run(mesh.mesh(), mesh.positions(), options);
            let smoothed = rest.with_positions(&x);
            assert!(smoothed.area().is_finite(), "{name}");
            let flips = folded_faces(&rest, &x).expect("same mesh").len();
            assert_eq!(flips, 0, "{name} {boundary:?}");
            let rim = |surface: &Surface<'_, f64>| -> f64 {
                let lengths = surface.edge_lengths();
                let is_rim = |e: &cotan::halfedge::EdgeId| mesh.mesh().is_boundary_edge(*e);
                mesh.mesh().edges().filter(is_rim).map(|e| lengths[e]).sum()
            };
            let (before, after) = (rim(&rest), rim(&smoothed));
            if boundary == Boundary::Fixed {
                assert_eq!(before, after, "{name}");
            } else {
                assert!(
                    (after - before).abs() <= 0.01 * before,
                    "{name}: {before} {after}"
                );
            }
        }
    }
}

/// A user-defined edit, as documented: implementing the trait is enough.
#[test]
fn a_users_edit_runs() {
    struct Flatten;
    impl CurvatureEdit for Flatten {
        fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64> {
            field.smoothed(5).values
        }
    }
    let shape = cotan::shapes::torus::<f64>(1.0, 0.4, 40, 20);
    let x = with_normal_noise(&shape.surface(), 0.01, 4);
    let options = DetailOptions::default();
    let y = edit_detail(
        shape.surface().with_positions(&x),
        &Handles::new(),
        &Flatten,
        &options,
    )
    .expect("runs");
    let moved = Displacement::measure(
        &shape.surface().with_positions(&x),
        &shape.surface().with_positions(&y),
    );
    assert!(moved.max > 0.0 && moved.max < 0.1);
    assert_eq!(curvature_field(&shape.surface()).len(), x.len());
    assert_eq!(shape.surface().vertex_normals().len(), x.len());
}
