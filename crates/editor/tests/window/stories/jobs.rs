//! Smoothing and the sphere map.

use cotan::Handles;
use cotan::smooth::{SmoothOptions, smooth};
use nalgebra::Point3;

use super::{open, save, undo_all};
use crate::harness::{Display, bytes};
use crate::models::Place;

#[test]
fn smoothing_and_the_sphere_are_the_librarys_and_are_undone() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let first = bytes(&place.mesh);
    let mut display = Display::start();
    let mut window = open(&mut display, &place);

    window.click_on("tab-smooth");
    window.click_on("smooth");
    window.wait("the smooth shape", |line| {
        line["label"] == "Smooth" && line["task"].is_null()
    });
    save(&mut window);
    let mesh = place.surface.mesh();
    let positions = place.surface.positions();
    let options = SmoothOptions::default();
    let job = smooth(
        cotan::Surface::assume_checked(mesh, positions),
        &Handles::new(),
        &options,
    )
    .unwrap();
    // Exactly equal, because the file stores every digit.
    assert_eq!(place.distance(&place.mesh, &job.positions, None), 0.0);

    window.click_on("tab-sphere");
    window.click_on("map");
    window.wait("the sphere", |line| line["morph"] == 1.0);
    let [left, top, _, bottom] = window.rect("morph");
    let y = 0.5 * (top + bottom);
    window.move_to(left + 60.0, y);
    window.press();
    window.wait("a shape between", |line| {
        let share = line["morph"].as_f64();
        share.is_some_and(|share| share > 0.0 && share < 1.0)
    });
    window.move_to(left + 1.0, y);
    window.wait("the mesh", |line| line["morph"] == 0.0);
    window.release();

    // Map once more and keep the result: the file has a sphere around the centre of the shape's
    // box.
    window.click_on("map");
    window.wait("the sphere", |line| line["morph"] == 1.0);
    window.click_on("keep-morph");
    window.wait("the sphere as the shape", |line| {
        line["morph"].is_null() && line["label"].as_str().is_some_and(|l| l.contains("sphere"))
    });
    save(&mut window);
    let sphere = cotan_io::load(&place.mesh).unwrap();
    let smooth = job.positions.values();
    let [low, high] = smooth.fold(
        [Point3::from([f64::MAX; 3]), Point3::from([f64::MIN; 3])],
        |[l, h], p| [l.inf(p), h.sup(p)],
    );
    let center = nalgebra::center(&low, &high);
    let radii = sphere.positions().iter().map(|p| (p - center).norm());
    let [least, most] = radii.fold([f64::MAX, 0.0], |[l, m], r| [r.min(l), r.max(m)]);
    assert!(most - least <= 1e-12 * most, "{least} to {most}");

    undo_all(&mut window);
    save(&mut window);
    assert_eq!(bytes(&place.mesh), first);
}
