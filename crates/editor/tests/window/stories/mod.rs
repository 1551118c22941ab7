//! The stories: user actions and their expected results.

mod crashes;
mod display;
mod editing;
mod files;
mod jobs;

use cotan::halfedge::VertexId;

use crate::harness::{Display, Start, Window};
use crate::models::Place;

/// Opens the window on a mesh.
fn open<'d>(display: &'d mut Display, place: &Place) -> Window<'d> {
    let mut window = start(display, place, &[]);
    window.wait_for_mesh();
    window
}

/// Starts the window on a mesh with further arguments, without waiting for the mesh: a dialog may
/// come first.
fn start<'d>(display: &'d mut Display, place: &Place, arguments: &[&str]) -> Window<'d> {
    let mesh = place.mesh.display().to_string();
    let mut all = vec![mesh];
    all.extend(arguments.iter().map(|a| (*a).to_owned()));
    let start = Start {
        program: crate::program(),
        data: place.path(),
        arguments: all,
    };
    Window::open(display, &start)
}

/// The vertex of the surface for a vertex of the file.
fn surface_vertex(place: &Place, vertex: usize) -> VertexId {
    place.surface.vertex(vertex).expect("it is of the surface")
}

/// Bends the mesh a little with one handle and three fixed vertices, until it has settled.
fn bend(window: &mut Window<'_>, place: &Place) {
    window.hold(place.document.positions(), 3);
    window.drag(3, [60.0, 50.0], 20);
    window.wait_for_rest();
}

/// Undoes all edits.
fn undo_all(window: &mut Window<'_>) {
    for _ in 0..20 {
        let Some(label) = window.now()["undo"].as_str().map(str::to_owned) else {
            return;
        };
        window.key("ctrl+z");
        window.wait("an edit to be undone", |line| {
            line["undo"].as_str() != Some(&label)
        });
    }
    panic!("there is no end to undoing");
}

/// Saves over the open file.
fn save(window: &mut Window<'_>) {
    window.wait("something to save", |line| line["is_changed"] == true);
    window.key("ctrl+s");
    window.wait("the save", |line| line["is_changed"] == false);
}
