//! A mesh is bent, saved, and brought back.

use cotan::{Handles, deform};
use cotan_editor::scene::editor_options;
use nalgebra::{Matrix4, Point3};

use super::{open, save, surface_vertex, undo_all};
use crate::harness::{Display, bytes};
use crate::models::Place;

/// What is saved is the shape that the library makes of the same handles; undone, it is the file of old.
fn a_handle_is_dragged(place: &Place, count: usize) {
    let first = bytes(&place.mesh);
    let mut display = Display::start();
    let mut window = open(&mut display, place);
    let all = window.hold(place.document.positions(), count);
    let (held, fixed) = (all[count], &all[..count]);
    window.drag(count, [70.0, 60.0], 25);
    window.wait_for_rest();
    let at = Point3::from(window.handle_at(count));
    save(&mut window);
    assert_ne!(bytes(&place.mesh), first);

    let way = at - place.document.positions()[held];
    assert!(way.norm() > 0.0);
    let handles = Handles::new()
        .fix(fixed.iter().map(|&v| surface_vertex(place, v)))
        .transform(
            [surface_vertex(place, held)],
            Matrix4::new_translation(&way),
        );
    let mesh = place.surface.mesh();
    let job = deform(mesh, place.surface.positions(), &handles, &editor_options()).unwrap();
    // Two points hold no shape: it may turn about the line through them, and how far it has, depends on
    // the way that the pointer took.
    let axis = (count == 1).then(|| [place.document.positions()[fixed[0]], at]);
    let distance = place.distance(&place.mesh, &job.positions, axis);
    assert!(distance <= 1e-6, "{distance:e} of the box");

    undo_all(&mut window);
    save(&mut window);
    assert_eq!(bytes(&place.mesh), first);
}

#[test]
fn a_dragged_handle_saves_what_the_library_makes_and_undo_brings_the_file_back() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    a_handle_is_dragged(&Place::with_creature(), 1);
    a_handle_is_dragged(&Place::with_creature(), 3);
    if let Some(place) = Place::with_shared("spot.obj") {
        a_handle_is_dragged(&place, 1);
        a_handle_is_dragged(&place, 3);
    }
}
