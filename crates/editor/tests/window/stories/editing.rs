//! Bending a mesh, saving it, and undoing.

use cotan::{Handles, deform};
use cotan_workspace::editor_options;
use nalgebra::{Matrix4, Point3};

use super::{open, save, surface_vertex, undo_all};
use crate::harness::{Display, bytes, numbers, project};
use crate::models::Place;

/// Checks that the saved shape is the one that the library computes from the same handles, and
/// that undo restores the original file.
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
    let job = deform(
        cotan::Surface::assume_checked(mesh, place.surface.positions()),
        &handles,
        &editor_options(),
    )
    .unwrap();
    // Two points leave a rotation about the line through them free, which depends on the path of
    // the pointer.
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

/// However many events a frame collects, a press on a mark grabs its handle, and the handle ends
/// up under the pointer.
#[test]
fn a_handle_is_where_the_pointer_let_go_of_it() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let mut display = Display::start();
    let mut window = open(&mut display, &place);
    window.hold(place.document.positions(), 3);
    for [dx, dy] in [[60.0, 40.0], [-50.0, -20.0], [40.0, -30.0]] {
        let at = window.handle_at(3);
        let [x, y, _] = project(&window.now(), at).unwrap();
        let [x, y] = [x.round(), y.round()];
        window.move_to(x, y);
        window.press();
        window.move_to(x + 0.5 * dx, y + dy);
        window.move_to(x + dx, y + dy);
        window.wait("the handle under the pointer", |line| {
            let at = numbers(&line["handles"][3]["at"]).unwrap();
            let [now_x, now_y, _] = project(line, [at[0], at[1], at[2]]).unwrap();
            (now_x - x - dx).hypot(now_y - y - dy) < 2.0
        });
        window.release();
        window.wait_for_rest();
    }
}
