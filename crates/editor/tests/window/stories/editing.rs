//! A mesh is bent, saved, and brought back.

use cotan::{Handles, deform};
use cotan_editor::scene::editor_options;
use nalgebra::{Matrix4, Vector3};

use super::{drag, handle_at, hold_two, open, save, surface_vertex, undo_all};
use crate::harness::{Display, bytes};
use crate::models::Place;

/// What is saved is the shape that the library makes of the same handles; undone, it is the file of old.
fn a_handle_is_dragged(place: &Place) {
    let first = bytes(&place.mesh);
    let mut display = Display::start();
    let mut window = open(&mut display, place);
    let [fixed, held] = hold_two(&mut window, place);
    drag(&mut window, 1, [70.0, 60.0], 25);
    window.wait_for_rest();
    let at = handle_at(&mut window, 1);
    save(&mut window);
    assert_ne!(bytes(&place.mesh), first);

    let rest = place.document.positions()[held];
    let way = Vector3::new(at[0] - rest.x, at[1] - rest.y, at[2] - rest.z);
    let handles = Handles::new()
        .fix([surface_vertex(place, fixed)])
        .transform([surface_vertex(place, held)], Matrix4::new_translation(&way));
    let mesh = place.surface.mesh();
    let job = deform(mesh, place.surface.positions(), &handles, &editor_options()).unwrap();
    let distance = place.distance(&place.mesh, &job.positions);
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
    a_handle_is_dragged(&Place::with_creature());
    if let Some(place) = Place::with_shared("spot.obj") {
        a_handle_is_dragged(&place);
    }
}
