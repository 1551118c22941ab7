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

#[test]
fn a_selection_is_hidden_isolated_and_shown_and_the_palette_finds_actions() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let mut display = Display::start();
    let mut window = open(&mut display, &place);
    let all = place.surface.mesh().num_vertices();
    let first = window.select(place.document.positions(), |[_, y, _]| y);
    window.key("ctrl+h");
    window.wait("a hidden vertex", |line| line["hidden"] == 1);
    window.key("ctrl+a");
    window.wait("the others", |line| line["selected"] == all - 1);
    window.key("ctrl+shift+h");
    window.wait("everything", |line| line["hidden"] == 0);
    let again = window.select(place.document.positions(), |[_, y, _]| y);
    assert_eq!(again, first);
    window.key("shift+h");
    window.wait("one vertex", |line| line["hidden"] == all - 1);
    window.key("ctrl+p");
    window.wait_for_dialog("palette");
    window.display.order("type --delay 40 everything");
    window.key("Return");
    window.wait_for_no_dialog();
    window.wait("everything", |line| line["hidden"] == 0);
    // The keys of the palette's text did nothing else.
    assert!(window.now()["handles"].as_array().unwrap().is_empty());
}

/// Fixes three vertices and makes a handle, which is moved and turned by typed numbers.
#[test]
fn a_handle_is_moved_by_typed_numbers_and_given_up_by_escape() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let mut display = Display::start();
    let mut window = open(&mut display, &place);
    window.hold(place.document.positions(), 3);
    let before = window.handle_at(3);
    let is_at = |line: &serde_json::Value, x: f64| {
        let at = numbers(&line["handles"][3]["at"]).unwrap();
        (at[0] - x).abs() < 1e-9 && (at[1] - before[1]).abs() < 1e-9
    };
    for key in ["g", "x", "period", "1", "5"] {
        window.key(key);
    }
    window.wait("the number", |line| line["typed"] == "Move X .15");
    window.wait("the handle", |line| is_at(line, before[0] + 0.15));
    window.key("Return");
    window.wait("no number", |line| line["typed"].is_null());
    window.wait_for_rest();
    assert!(is_at(&window.now(), before[0] + 0.15));
    assert_eq!(window.now()["label"], "Move A");
    for key in ["g", "x", "9"] {
        window.key(key);
    }
    window.wait("the handle", |line| is_at(line, before[0] + 9.15));
    window.key("Escape");
    window.wait("the handle where it was", |line| {
        line["typed"].is_null() && is_at(line, before[0] + 0.15)
    });
    // Esc has given up the innermost only.
    assert_eq!(window.now()["active"], 3);
}

#[test]
fn the_mirror_selects_on_both_sides_and_a_stroke_is_painted() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let mut display = Display::start();
    let mut window = open(&mut display, &place);
    window.key("m");
    window.wait("the mirror", |line| {
        line["mirror"] == true && line["task"].is_null()
    });
    let [left, top, right, bottom] = window.rect("viewport");
    window.click(0.5 * (left + right), 0.5 * (top + bottom));
    window.wait("two vertices", |line| line["selected"] == 2);
    window.key("Escape");
    window.wait("nothing selected", |line| line["selected"] == 0);
    window.click_on("tab-paint");
    window.rect("brush-radius");
    let middle = [0.5 * (left + right), 0.5 * (top + bottom)];
    window.move_to(middle[0], middle[1]);
    window.press();
    for k in 0..8 {
        window.move_to(middle[0] + 3.0 * f64::from(k), middle[1]);
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    window.release();
    let line = window.wait("the painted shape", |line| {
        line["task"].is_null()
            && line["label"]
                .as_str()
                .is_some_and(|l| l.starts_with("Brush"))
    });
    assert_eq!(line["is_changed"], true);
    undo_all(&mut window);
}
