//! Guarantees of the embedding on the sphere for real models: no flip in either precision, and
//! less than a third of the area distortion of a conformal map.

use cotan::prelude::*;
use cotan::sphere::{SphereMap, embed};

/// Models small enough for every test run, with the mean |ln area ratio| of their conformal maps
/// (`shared/reference/sphere.json`).
const MODELS: [(&str, f64); 5] = [
    ("spot.obj", 1.85),
    ("fandisk.obj", 0.73),
    ("duck.glb", 1.04),
    // Two faces without area, and slivers.
    ("cartoon_elephant.obj", 3.13),
    ("dinosaur.obj", 8.83),
];

#[test]
fn real_models_are_embedded_with_their_areas() {
    for (name, conformal) in MODELS {
        let Some(model) = cotan_tests::model(name) else {
            continue;
        };
        let (mesh, source) = (model.mesh(), model.positions());
        let sphere = embed::<f64>(mesh, source, 1.0).expect("an embedding");
        let map = SphereMap::new(mesh, sphere).expect("a valid map");
        let log = log_area(&map, source);
        assert!(log < conformal / 9.0, "{name}: {log}");
        let single = embed::<f32>(mesh, source, 0.0).expect("an embedding");
        SphereMap::new(mesh, single).expect("a valid map in f32");
    }
}

/// The mean of |ln area ratio| over the source's area.
fn log_area(map: &SphereMap<f64>, source: &Positions<f64>) -> f64 {
    let surface = Surface::new(map.mesh(), source).expect("a surface");
    let areas = surface.face_areas();
    let total: f64 = areas.values().sum();
    let of_face = |(f, area): (FaceId, &f64)| {
        let share = area / total;
        let ratio = map.solid_angle(f) / (4.0 * std::f64::consts::PI) / share;
        if share > 0.0 {
            share * ratio.ln().abs()
        } else {
            0.0
        }
    };
    areas.iter().map(of_face).sum()
}
