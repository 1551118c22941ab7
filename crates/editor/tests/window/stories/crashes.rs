//! The program crashes or is killed, and the work is still there.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::{bend, open, save, start};
use crate::harness::{DEADLINE, Display, Window, bytes};
use crate::models::{Place, autosaves};

/// Bends the mesh without saving it: the file is unchanged, and only the editor has the bent
/// shape.
///
/// Returns the bytes that the bent mesh would be saved as.
fn leave_unsaved(window: &mut Window<'_>, place: &Place) -> Vec<u8> {
    let first = bytes(&place.mesh);
    bend(window, place);
    save(window);
    let bent = bytes(&place.mesh);
    assert_ne!(bent, first);
    window.key("ctrl+z");
    save(window);
    assert_eq!(bytes(&place.mesh), first);
    assert!(autosaves(place.path()).is_empty());
    window.key("ctrl+shift+z");
    window.wait("the bent shape", |line| line["is_changed"] == true);
    bent
}

/// The single autosave, which must be accessible to its owner only.
fn only_autosave(place: &Place) -> PathBuf {
    let all = autosaves(place.path());
    let [one] = all.as_slice() else {
        panic!("not one autosave but {all:?}");
    };
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = std::fs::metadata(one).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
    }
    one.clone()
}

/// Starts again, recovers and saves. The file must then have these bytes.
fn recover(place: &Place, bent: &[u8]) {
    let mut display = Display::start();
    let mut window = start(&mut display, place, &[]);
    window.wait_for_dialog("recover");
    window.click_on("answer-0");
    window.wait_for_no_dialog();
    window.wait("the work", |line| line["undo"] == "Recovered");
    save(&mut window);
    assert_eq!(bytes(&place.mesh), bent);
    assert!(autosaves(place.path()).is_empty());
}

#[test]
fn what_a_panic_interrupts_is_recovered_bit_for_bit() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let mut display = Display::start();
    let mut window = start(&mut display, &place, &["--breakable"]);
    window.wait_for_mesh();
    let bent = leave_unsaved(&mut window, &place);
    window.key("ctrl+shift+F12");
    let status = window.wait_for_end();
    assert_eq!(status.code(), Some(101), "{}", window.errors());
    drop(window);
    only_autosave(&place);
    recover(&place, &bent);
}

#[test]
fn what_a_kill_interrupts_is_recovered_bit_for_bit() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let mut display = Display::start();
    let mut window = open(&mut display, &place);
    let bent = leave_unsaved(&mut window, &place);
    // No further action: the program autosaves by itself.
    let deadline = Instant::now() + DEADLINE;
    while autosaves(place.path()).is_empty() {
        assert!(Instant::now() < deadline, "nothing was put aside");
        std::thread::sleep(Duration::from_millis(20));
    }
    window.kill();
    drop(window);
    only_autosave(&place);
    recover(&place, &bent);
}

#[test]
fn work_thrown_away_is_not_offered_again() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let mut display = Display::start();
    let mut window = start(&mut display, &place, &["--breakable"]);
    window.wait_for_mesh();
    bend(&mut window, &place);
    window.key("ctrl+shift+F12");
    window.wait_for_end();
    drop(window);
    only_autosave(&place);
    // After "Later" the autosave is offered again, after "Throw away" it is not.
    for answer in ["answer-2", "answer-1"] {
        let mut window = start(&mut display, &place, &[]);
        window.wait_for_dialog("recover");
        window.click_on(answer);
        window.wait_for_no_dialog();
        window.wait_for_mesh();
        window.ask_to_close();
        assert!(window.wait_for_end().success());
    }
    assert!(autosaves(place.path()).is_empty());
    let mut window = open(&mut display, &place);
    window.wait_for_no_dialog();
}

#[test]
fn the_window_outlives_a_solver_that_breaks_down() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let mut display = Display::start();
    let mut window = start(&mut display, &place, &["--breakable"]);
    window.wait_for_mesh();
    bend(&mut window, &place);
    window.key("ctrl+shift+F11");
    window.wait("the breakdown", |line| line["state"] == "failed");
    let told = window.now()["problem"].as_str().map(str::to_owned);
    assert!(told.is_some_and(|text| text.contains("the solver crashed")));
    window.drag(3, [-40.0, 30.0], 20);
    window.wait_for_rest();
    let before = bytes(&place.mesh);
    save(&mut window);
    assert_ne!(bytes(&place.mesh), before);
}
