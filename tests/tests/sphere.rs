//! Spherical parameterization of real models: the reference cases of part B, the paper's claims,
//! and no flipped triangles.

use cotan::flow::{AlongNormal, Flow, Projection, Rest, Schedule, Start, nearest_rotation};
use cotan::prelude::*;
use cotan::sphere::{
    AreaMeasure, ConstantCurvature, SphereMethod, SphereOptions, SphereQuality, Spherical,
    spherical,
};
use cotan_io::ProcessingMesh;
use cotan_tests::{closed_models, model, numbers, shared};
use nalgebra::Matrix3;
use serde_json::Value;

fn json(path: &str) -> Option<Value> {
    let text = std::fs::read_to_string(shared(path)?).expect("readable");
    Some(serde_json::from_str(&text).expect("valid JSON"))
}

fn scheme(scheme: SchemeKind) -> SphereOptions {
    SphereOptions::default().scheme(scheme)
}

fn map(mesh: &ProcessingMesh, options: &SphereOptions) -> (Spherical<f64>, SphereQuality) {
    let done = spherical(mesh.surface(), options).expect("a map");
    let surface = Surface::new(mesh.mesh(), mesh.positions()).expect("a surface");
    let quality = SphereQuality::measure(&surface, &done.map);
    (done, quality)
}

fn assert_close(what: &str, ours: f64, theirs: f64, tolerance: f64) {
    let relative = (ours / theirs - 1.0).abs();
    assert!(
        relative <= tolerance,
        "{what}: {ours} against {theirs}, off by {relative:.1e}"
    );
}

/// `sphere.json`: the robust iteration with cotangent and uniform weights, and conformalized
/// mean-curvature flow, wherever the reference has no flip.
///
/// The tolerances are those of the public models: 0.5 % for means, 1 % for 99th percentiles. The
/// flow of the reference stopped earlier or later than ours, hence 1 %.
#[test]
fn reference_cases_of_the_models() {
    let Some(reference) = json("reference/sphere.json") else {
        return;
    };
    let large = 45_000;
    for case in reference["cases"].as_array().expect("cases") {
        let name = case["mesh"].as_str().expect("a name");
        if case["vertices"].as_u64().expect("a count") > large {
            // The table in docs/decisions has these; here they would take minutes.
            continue;
        }
        let Some(mesh) = model(name) else { return };
        let cmcf = SphereOptions::default().method(SphereMethod::Cmcf);
        let methods = [
            (
                "cotangent",
                scheme(SchemeKind::Cotangent),
                [0.005, 0.01, 0.005],
            ),
            (
                "tutte_symmetric",
                scheme(SchemeKind::Tutte),
                [0.005, 0.01, 0.005],
            ),
            ("cmcf", cmcf, [0.01, 0.01, 0.01]),
        ];
        for (method, options, [mean, p99, area]) in methods {
            let expected = &case[method];
            if expected["flipped"] != 0 {
                continue;
            }
            let (_, ours) = map(&mesh, &options);
            let what = |field: &str| format!("{name}, {method}, {field}");
            let of = |field: &str| expected[field].as_f64().expect("a number");
            let distortion = ours.conformal_distortion;
            assert_close(&what("mean"), distortion.mean, of("sigma_ratio_mean"), mean);
            assert_close(&what("p99"), distortion.p99, of("sigma_ratio_p99"), p99);
            let ours = ours.area_distortion.mean;
            assert_close(&what("area"), ours, of("abs_log_area_mean"), area);
        }
    }
}

/// The public cases whose models are available, with their iterations and positions.
#[test]
fn reference_cases_of_the_public_models() {
    let Some(reference) = json("reference/sphere-smoothing-public-models.json") else {
        return;
    };
    for case in reference["sphere"].as_array().expect("cases") {
        let name = case["mesh"].as_str().expect("a name");
        if !["spot", "fandisk"].contains(&name) {
            continue;
        }
        let Some(mesh) = model(&format!("{name}.obj")) else {
            return;
        };
        let weights = match case["weights"].as_str() {
            Some("cot") => SchemeKind::Cotangent,
            _ => SchemeKind::Uniform,
        };
        let (done, ours) = map(&mesh, &scheme(weights));
        let what = |field: &str| format!("{name}, {}, {field}", weights.name());
        let of = |field: &str| case[field].as_f64().expect("a number");
        let distortion = ours.conformal_distortion;
        assert_close(&what("mean"), distortion.mean, of("K_mean"), 0.005);
        assert_close(&what("p99"), distortion.p99, of("K_99"), 0.01);
        let area = ours.area_distortion.mean;
        assert_close(&what("area"), area, of("area_log_mean"), 0.005);
        assert_eq!(ours.flipped_triangles, 0);
        let iterations = numbers(&case["iterations_per_round"])[0];
        assert!((done.report.iterations as f64 - iterations).abs() <= 2.0);
        // Centring leaves a rotation free, which three vertices determine.
        let mut covariance = Matrix3::zeros();
        let mut pairs = Vec::new();
        for (vertex, at) in case["vertices"].as_object().expect("positions") {
            let v = VertexId::new(vertex.parse().expect("a number"));
            let (at, ours) = (
                Vector3::from_vec(numbers(at)),
                done.map.positions()[v].coords,
            );
            covariance += at * ours.transpose();
            pairs.push((at, ours));
        }
        let rotation = nearest_rotation(&covariance);
        for (at, ours) in pairs {
            assert!(
                (rotation * ours - at).amax() < 5e-4,
                "{}",
                what("positions")
            );
        }
    }
}

/// No projection.
///
/// The size of the last step is reported as infinite, so that the run does not stop.
struct Free;

impl Projection<f64> for Free {
    fn start(
        &mut self,
        _: &Rest<f64>,
        _: &mut Positions<f64>,
    ) -> Result<(), cotan::flow::FlowError> {
        Ok(())
    }

    fn project(
        &mut self,
        _: &Rest<f64>,
        _: &Positions<f64>,
        _: &mut Positions<f64>,
    ) -> Result<f64, cotan::flow::FlowError> {
        Ok(f64::INFINITY)
    }
}

/// Without anything that fixes the scale the rule collapses: r ← 3 κ r².
///
/// With one-ring areas this is exact; with area vectors, as in the reference, there is a
/// discretization factor.
#[test]
fn a_fixed_curvature_collapses_as_in_the_reference() {
    let Some(reference) = json("reference/sphere-smoothing-public-models.json") else {
        return;
    };
    let radii = numbers(&reference["unit"][0]["radii"]);
    let exact: Vec<f64> = (1..=4).map(|t| 0.9f64.powi(1 << t)).collect();
    // Our icosphere differs from that of the reference, but has the same level.
    for (measure, radii, tolerance) in [
        (AreaMeasure::Ring, exact, 1e-3),
        (AreaMeasure::Vector, radii, 5e-3),
    ] {
        for (ours, expected) in collapse(measure).into_iter().zip(radii) {
            assert_close("radius", ours, expected, tolerance);
        }
    }
}

/// The radii of an icosphere of radius 0.9 in four steps with κ = 1/3.
fn collapse(measure: AreaMeasure) -> Vec<f64> {
    let shape = cotan::shapes::icosphere::<f64>(3);
    let positions = shape.positions().map(|p| p * 0.9);
    // In box units lengths are divided by 1.8, so curvatures are multiplied by it.
    let size = 1.8;
    let mut flow = Flow::builder(shape.connectivity(), &positions)
        .updater(ConstantCurvature::fixed(size / 3.0, measure))
        .projected(AlongNormal::NormalOnly, Free)
        .handles([(Handle::hard(VertexId::new(0)), positions[VertexId::new(0)])])
        .schedule(Schedule::FULL)
        .start(Start::Updated)
        .build()
        .expect("a flow");
    let radius = |x: &Positions<f64>| {
        let n = x.len() as f64;
        let mean = x.values().map(|p| p.coords).sum::<Vector3<f64>>() / n;
        x.values().map(|p| (p.coords - mean).norm()).sum::<f64>() / n
    };
    let mut step = || {
        flow.step().expect("a step");
        radius(flow.box_positions()) * size
    };
    (0..4).map(|_| step()).collect()
}

/// Figure 9: both weightings give a map.
///
/// Cotangents keep the angles; Tutte's weights even out the edge lengths and the angles of the
/// triangles on the sphere.
#[test]
fn cotangents_keep_angles_and_tutte_evens_them_out() {
    for name in [
        "duck.glb",
        "cartoon_elephant.obj",
        "venus_33587_derived.ply",
    ] {
        let Some(mesh) = model(name) else { return };
        let [cotangent, tutte] = [SchemeKind::Cotangent, SchemeKind::Tutte].map(|kind| {
            let (done, quality) = map(&mesh, &scheme(kind));
            let sphere = Surface::new(mesh.mesh(), done.map.positions()).expect("a surface");
            (quality, evenness(&sphere))
        });
        let errors = [&cotangent, &tutte].map(|(q, _)| q.angle_error_degrees.mean);
        assert!(3.0 * errors[0] < errors[1], "{name}: {errors:?}");
        let ([edges, angles], [tutte_edges, tutte_angles]) = (cotangent.1, tutte.1);
        assert!(tutte_edges < edges, "{name}: {tutte_edges} {edges}");
        assert!(tutte_angles < angles, "{name}: {tutte_angles} {angles}");
    }
}

/// The unevenness of edge lengths (the mean over triangles of ln(longest / shortest)), and the
/// root mean square deviation of the angles from 60°.
fn evenness(surface: &Surface<'_, f64>) -> [f64; 2] {
    let mesh = surface.mesh();
    let (mut edges, mut angles) = (0.0, 0.0);
    for f in mesh.faces() {
        let lengths: Vec<f64> = mesh
            .face_halfedges(f)
            .map(|h| surface.halfedge_vector(h).norm())
            .collect();
        let ends = lengths
            .iter()
            .fold((f64::INFINITY, 0.0f64), |(a, b), l| (a.min(*l), b.max(*l)));
        edges += (ends.1 / ends.0).ln();
        for angle in mesh
            .face_halfedges(f)
            .map(|h| cotan_geometry::halfedge_corner_angle(surface, h))
        {
            angles += (angle - std::f64::consts::FRAC_PI_3).powi(2) / 3.0;
        }
    }
    let n = mesh.num_faces() as f64;
    [edges / n, (angles / n).sqrt()]
}

/// Every closed genus-0 model except the large ones, which the example `sphere_table` measures.
#[test]
fn no_triangle_of_any_model_is_flipped() {
    for name in closed_models() {
        let Some(mesh) = model(name) else { return };
        if mesh.positions().len() > 50_000 {
            continue;
        }
        let (done, quality) = map(&mesh, &SphereOptions::default());
        assert_eq!(quality.flipped_triangles, 0, "{name}");
        assert_eq!(quality.degree, 1, "{name}");
        assert!(quality.sphericity_error < 1e-12, "{name}");
        assert_eq!(done.report.stop, Some(StopReason::Converged), "{name}");
    }
}

/// Angles are as in conformalized mean-curvature flow, wherever that has no flip.
///
/// With areas requested, the area distortion is less than a third of the conformal map's.
#[test]
fn angles_are_those_of_the_conformal_flow_and_areas_are_evened_out() {
    for name in closed_models() {
        let Some(mesh) = model(name) else { return };
        if mesh.positions().len() > 15_000 {
            continue;
        }
        let (_, conformal) = map(&mesh, &SphereOptions::default());
        let options = SphereOptions::default().method(SphereMethod::Cmcf);
        if let Ok(theirs) = spherical(mesh.surface(), &options) {
            let surface = Surface::new(mesh.mesh(), mesh.positions()).expect("a surface");
            let theirs = SphereQuality::measure(&surface, &theirs.map);
            let (ours, theirs) = (conformal.conformal_distortion, theirs.conformal_distortion);
            assert_close(name, ours.mean, theirs.mean, 0.01);
        }
        let mut last = conformal;
        for authalic in [0.5, 1.0] {
            let options = SphereOptions::default().authalic(authalic);
            let (_, quality) = map(&mesh, &options);
            // The slider trades one for the other.
            assert!(
                quality.area_distortion.mean < last.area_distortion.mean,
                "{name}"
            );
            last = quality;
        }
        let [even, uneven] = [last, conformal].map(|q| q.area_distortion.mean);
        assert!(3.0 * even < uneven, "{name}: {even} {uneven}");
    }
}
