//! The reference cases of `shared/reference/deform.json`, within their stated tolerances. They
//! correspond to tables 1 and 2 of the paper, on public models.

use std::ops::ControlFlow;

use cotan::flow::{Flow, FlowBuilder, KeepMagnitude, Limited, Orientation, Reflect, RescaleByArea};
use cotan::prelude::*;
use cotan::{ShapeErrors, halfedge::HalfedgeMesh};
use cotan_tests::{
    Case, arap_energy_by_edges, boxed, model, numbers, reference, reference_cases, vertex_ids,
};
use serde_json::Value;

/// E_p and E_g after each of the given iterations.
fn errors_at(
    mesh: &HalfedgeMesh,
    positions: &Positions<f64>,
    builder: FlowBuilder<f64>,
    iterations: &[usize],
) -> Vec<ShapeErrors> {
    let last = iterations.last().copied().unwrap_or(0);
    let mut flow = builder
        .acceleration(Acceleration::Off)
        .tolerance(0.0)
        .iteration_limit(last)
        .build()
        .expect("a reference case builds");
    let rest = Surface::new(mesh, positions).expect("a surface");
    let mut errors = Vec::new();
    let report = flow
        .run(|flow, step| {
            if iterations.contains(&step.iteration) {
                let now = flow.positions();
                errors.push(
                    ShapeErrors::measure(&rest, &rest.with_positions(&now)).expect("same mesh"),
                );
            }
            ControlFlow::Continue(())
        })
        .expect("a reference case runs");
    assert_eq!(report.iterations, last);
    errors
}

fn assert_close(what: &str, ours: f64, theirs: f64, tolerance: f64) {
    let relative = (ours / theirs - 1.0).abs();
    assert!(
        relative <= tolerance,
        "{what}: {ours} against {theirs}, off by {relative:.1e}"
    );
}

/// Compares with rows [iteration, E_p, E_g, E_g rms].
///
/// `offset` is our iteration count minus theirs.
fn compare_rows(
    name: &str,
    rows: &Value,
    offset: usize,
    errors: impl Fn(&[usize]) -> Vec<ShapeErrors>,
) {
    let rows: Vec<Vec<f64>> = rows.as_array().expect("rows").iter().map(numbers).collect();
    let iterations: Vec<usize> = rows.iter().map(|r| r[0] as usize + offset).collect();
    for (row, ours) in rows.iter().zip(errors(&iterations)) {
        let pairs = [
            ("E_p", ours.parameterization, row[1]),
            ("E_g", ours.geometry, row[2]),
            ("E_g rms", ours.geometry_rms, row[3]),
        ];
        for (measure, ours, theirs) in pairs {
            let what = format!("{name}, iteration {}, {measure}", row[0]);
            match row[0] as usize {
                0..=3 => assert_close(&what, ours, theirs, 1e-3),
                10 => assert_close(&what, ours, theirs, 0.05),
                // Values near rounding: within a factor of 3.
                _ => assert!(
                    (theirs / 3.0..theirs * 3.0).contains(&ours),
                    "{what}: {ours} against {theirs}"
                ),
            }
        }
    }
}

fn orientation(name: &str) -> Box<dyn Orientation<f64>> {
    match name {
        "reflect" => Box::new(Reflect::new()),
        "limited" => Box::new(Limited::new()),
        other => panic!("no orientation named {other} in the reference"),
    }
}

fn builder(case: &Case) -> FlowBuilder<f64> {
    let entry = case.reference.as_ref().expect("a reference case");
    let targets = cotan_tests::points(&entry["targets"]);
    let handles = vertex_ids(&entry["handles"])
        .into_iter()
        .map(cotan::linear::Handle::hard)
        .zip(targets)
        .collect::<Vec<_>>();
    Flow::builder(case.mesh.mesh(), &case.positions)
        .handles(handles)
        .start(Start::Original)
}

/// Table 2: shapes rebuilt from their two scalar fields, starting from zero vectors.
#[test]
fn reconstruction_falls_by_the_papers_decades() {
    let Some(reference) = reference() else { return };
    for entry in reference["reconstruct"].as_array().expect("cases") {
        let name = entry["mesh"].as_str().expect("a name");
        let Some(mesh) = model(name) else { continue };
        let positions = boxed(&mesh);
        let handles: Vec<_> = vertex_ids(&entry["handles"])
            .into_iter()
            .map(|v| (cotan::linear::Handle::hard(v), positions[v]))
            .collect();
        for row in entry["rows"].as_array().expect("rows") {
            let rule = row["orientation"].as_str().expect("a name");
            compare_rows(
                &format!("{name} {rule}"),
                &row["iteration_Ep_Eg_Egrms"],
                1,
                |iterations| {
                    let builder = Flow::builder(mesh.mesh(), &positions)
                        .handles(handles.clone())
                        .start(Start::Zero)
                        .orientation(orientation(rule));
                    errors_at(mesh.mesh(), &positions, builder, iterations)
                },
            );
        }
    }
}

/// Table 1: without updating, and with the paper's reorientation, iteration by iteration.
#[test]
fn the_papers_reorientation_is_reproduced() {
    for case in reference_cases() {
        let entry = case.reference.as_ref().expect("a reference case");
        compare_rows(
            &case.name,
            &entry["reflect_s1_iteration_Ep_Eg_Egrms"],
            0,
            |iterations| {
                let builder = builder(&case).orientation(Reflect::new());
                errors_at(case.mesh.mesh(), &case.positions, builder, iterations)
            },
        );
        let none = numbers(&entry["no_updating_Ep_Eg_Egrms"]);
        let rows = entry["reflect_s1_iteration_Ep_Eg_Egrms"]
            .as_array()
            .expect("rows");
        let reoriented = numbers(rows.last().expect("a row"));
        assert!(
            reoriented[1] < none[0],
            "{}: reorientation lowers E_p",
            case.name
        );
    }
}

/// The converged states of `limited`, with and without rescaling, where the reference converged.
#[test]
fn limited_converges_to_the_reference() {
    for case in reference_cases() {
        let entry = case.reference.as_ref().expect("a reference case");
        let mut parameterization = Vec::new();
        for (key, rescale) in [
            ("limited_converged", false),
            ("limited_rescaled_converged", true),
        ] {
            let expected = &entry[key];
            // Where the reference stalled, the final state is arbitrary.
            if expected["last_residual"].as_f64().is_none_or(|r| r >= 1e-5) {
                continue;
            }
            let updater: Box<dyn cotan::flow::ScalarFieldUpdater<f64>> = if rescale {
                Box::new(RescaleByArea)
            } else {
                Box::new(KeepMagnitude)
            };
            let mut flow = builder(&case)
                .orientation(Limited::new())
                .updater(updater)
                .acceleration(Acceleration::Memory(5))
                .tolerance(1e-6)
                .build()
                .expect("a reference case builds");
            let report = flow.run(|_, _| ControlFlow::Continue(())).expect("runs");
            assert_eq!(report.stop, StopReason::Converged, "{} {key}", case.name);
            let rest = Surface::new(case.mesh.mesh(), &case.positions).expect("a surface");
            let now = flow.positions();
            let moved = rest.with_positions(&now);
            let quality = Quality::measure(&rest, &moved).expect("same mesh");
            assert!(quality.arap_energy >= 0.0, "{} {key}", case.name);
            let values = numbers(&expected["Ep_Eg_Egrms"]);
            let number = |key: &str| expected[key].as_f64().expect("a number");
            let pairs = [
                ("E_p", quality.errors.parameterization, values[0]),
                ("E_g", quality.errors.geometry, values[1]),
                (
                    "volume",
                    quality.volume_ratio.expect("closed"),
                    number("volume_ratio"),
                ),
                (
                    "edges",
                    quality.edge_distortion_rms,
                    number("edge_distortion_rms"),
                ),
                (
                    "ARAP",
                    arap_energy_by_edges(&rest, &moved),
                    number("arap_energy"),
                ),
            ];
            for (measure, ours, theirs) in pairs {
                assert_close(
                    &format!("{} {key} {measure}", case.name),
                    ours,
                    theirs,
                    0.02,
                );
            }
            let folds = number("folds") as usize;
            assert!(
                quality.folded_edges <= folds + 2,
                "{}: {} folds",
                case.name,
                quality.folded_edges
            );
            parameterization.push(quality.errors.parameterization);
        }
        if let [kept, rescaled] = parameterization[..] {
            // Table 1: rescaling lowers E_p further. The exception is the twist of spot, in the
            // reference (1.102 → 1.115) as here.
            assert!(
                rescaled < kept || case.name == "spot.obj twist",
                "{}",
                case.name
            );
        }
    }
}
