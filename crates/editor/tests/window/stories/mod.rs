//! What a person does, and what must come of it.

mod crashes;
mod display;
mod editing;
mod files;
mod jobs;

use std::time::{Duration, Instant};

use cotan::halfedge::VertexId;

use crate::harness::{Display, Start, Window, project};
use crate::models::Place;

/// The window on a mesh.
fn open<'d>(display: &'d mut Display, place: &Place) -> Window<'d> {
    let mut window = start(display, place, &[]);
    window.wait_for_mesh();
    window
}

/// The window on a mesh, with further arguments; it may have something else to say first.
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

/// Clicks visible vertices until one of them is selected, those first that `rank` puts lowest by where
/// they are in the window; returns its number in the file.
fn select(window: &mut Window<'_>, place: &Place, rank: impl Fn([f64; 3]) -> f64) -> usize {
    let line = window.now();
    let all = place.document.positions().iter().enumerate();
    let mut seen: Vec<(usize, [f64; 3])> = all
        .filter_map(|(v, p)| Some((v, project(&line, [p.x, p.y, p.z])?)))
        .collect();
    seen.sort_by(|a, b| rank(a.1).total_cmp(&rank(b.1)));
    for (vertex, [x, y, _]) in seen.into_iter().step_by(7).take(60) {
        window.click(x.round(), y.round());
        // Behind the surface, another vertex is nearer: the next one, then.
        let patience = Instant::now() + Duration::from_secs(2);
        while Instant::now() < patience {
            let line = window.now();
            match line["selection"].as_array().map(Vec::as_slice) {
                Some([one]) if one.as_u64() == Some(vertex as u64) => return vertex,
                Some([]) | None => std::thread::sleep(Duration::from_millis(4)),
                Some(_) => break,
            }
        }
    }
    panic!("no vertex lets itself be selected: {}", window.now());
}

/// Fixes as many vertices as asked for, each on its own, and makes a handle at the upper end of the
/// picture; returns their numbers in the file, the handle's last.
///
/// The first is at the lower end, the next at the left and the right.
fn hold(window: &mut Window<'_>, place: &Place, fixed: usize) -> Vec<usize> {
    let ranks: [fn([f64; 3]) -> f64; 3] = [|[_, y, _]| -y, |[x, ..]| x, |[x, ..]| -x];
    let mut held = Vec::new();
    for rank in ranks.into_iter().take(fixed) {
        held.push(select(window, place, rank));
        press_and_count(window, "x", held.len());
    }
    held.push(select(window, place, |[_, y, _]| y));
    press_and_count(window, "h", held.len());
    held
}

/// Presses a key that makes a handle, which is then the last of so many.
fn press_and_count(window: &mut Window<'_>, key: &str, count: usize) {
    window.key(key);
    window.wait("a handle", |line| {
        line["handles"].as_array().is_some_and(|h| h.len() == count)
    });
}

/// Where a handle is.
fn handle_at(window: &mut Window<'_>, handle: usize) -> [f64; 3] {
    let at = crate::harness::numbers(&window.now()["handles"][handle]["at"]);
    let at = at.unwrap_or_else(|| panic!("there is no handle {handle}"));
    [at[0], at[1], at[2]]
}

/// Drags a handle by its mark, in `steps` events, to a place that is `by` points away; and lets go.
fn drag(window: &mut Window<'_>, handle: usize, by: [f64; 2], steps: u32) {
    let at = handle_at(window, handle);
    let [x, y, _] = project(&window.now(), at).expect("the handle is seen");
    window.move_to(x, y);
    window.press();
    for k in 1..=steps {
        let share = f64::from(k) / f64::from(steps);
        // Not straight: the way must not matter.
        let swing = 30.0 * (share * std::f64::consts::PI).sin();
        window.move_to(x + share * by[0] + swing, y + share * by[1]);
        std::thread::sleep(Duration::from_millis(16));
    }
    window.wait("the handle to have followed", |line| {
        line["is_dragging"] == true && line["handles"][handle]["at"][0].as_f64() != Some(at[0])
    });
    window.release();
    window.wait("the handle to be let go of", |line| {
        line["is_dragging"] == false
    });
}

/// The vertex of the surface that a vertex of the file is.
fn surface_vertex(place: &Place, vertex: usize) -> VertexId {
    place.surface.vertex(vertex).expect("it is of the surface")
}

/// Bends the mesh a little, by a handle and three fixed vertices, until it has come to rest.
fn bend(window: &mut Window<'_>, place: &Place) {
    hold(window, place, 3);
    drag(window, 3, [60.0, 50.0], 20);
    window.wait_for_rest();
}

/// Undoes all there is.
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

/// Saves over the file that is open.
fn save(window: &mut Window<'_>) {
    window.wait("something to save", |line| line["is_changed"] == true);
    window.key("ctrl+s");
    window.wait("the save", |line| line["is_changed"] == false);
}
