//! Latency from pointer to picture, measured at the window with real X events.
//!
//! `cargo build --release -p cotan-editor --bins`, then
//! `cargo run --release -p cotan-editor --example latency -- MESH...`
//!
//! On each mesh three vertices are fixed and one is dragged by its mark, with two hundred events
//! at sixty per second. An event is answered when the screen shows a frame whose shape was
//! computed for that pointer position or a later one. A frame counts as shown when the next one
//! begins, or when it has been drawn if there is no next one.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde_json::Value;

#[allow(dead_code, reason = "the tests of the window need more of it")]
#[path = "../tests/window/harness.rs"]
mod harness;

use harness::{Display, Start, Window, numbers, project};

const EVENTS: usize = 200;
const EVERY: Duration = Duration::from_nanos(1_000_000_000 / 60);

fn main() -> Result<(), Box<dyn Error>> {
    if let Some(problem) = harness::missing_tools() {
        return Err(problem.into());
    }
    let meshes: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    if meshes.is_empty() {
        return Err("usage: latency MESH...".into());
    }
    let example = std::env::current_exe()?;
    let folder = example.parent().and_then(Path::parent);
    let program = folder.map(|folder| folder.join("cotan-editor"));
    let program = program.filter(|program| program.is_file());
    let program = program.ok_or("build the program beside this: --bins")?;
    if cfg!(debug_assertions) {
        println!("note: this is no release build");
    }
    for mesh in &meshes {
        println!("{}", mesh.display());
        measure(&program, mesh)?;
    }
    Ok(())
}

fn measure(program: &Path, mesh: &Path) -> Result<(), Box<dyn Error>> {
    let document = cotan_io::load(mesh)?;
    let data = tempfile::tempdir()?;
    let start = Start {
        program,
        data: data.path(),
        arguments: vec![mesh.display().to_string()],
    };
    let mut display = Display::start();
    let mut window = Window::open(&mut display, &start);
    let line = window.wait_for_mesh();
    println!("  vertices, faces: {}; {}", line["size"], load());
    window.hold(document.positions(), 3);
    // The system is factorized when the handle first moves.
    window.drag(3, [20.0, 10.0], 10);
    window.wait_for_rest();
    let events = drag(&mut window)?;
    window.wait_for_rest();
    let frames = window.frames();
    report(frames, &events);
    println!("  {}", load());
    Ok(())
}

/// The load of the machine, if the system reports it.
fn load() -> String {
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let minute = load.split(' ').next().unwrap_or_default();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("load {minute} on {cores} cores")
}

/// An event: its time in seconds since 1970, and the pointer position in pixels.
struct Event {
    at: f64,
    pointer: [i32; 2],
}

/// Drags the handle along a curve that never returns to the same place.
fn drag(window: &mut Window<'_>) -> Result<Vec<Event>, Box<dyn Error>> {
    let at = window.handle_at(3);
    let [x, y, _] = project(&window.now(), at).ok_or("the handle is not seen")?;
    let [x, y] = [x.round(), y.round()];
    window.move_to(x, y);
    window.press();
    window.wait("the handle to be held", |line| line["is_dragging"] == true);
    let begin = Instant::now();
    let mut events: Vec<Event> = Vec::with_capacity(EVENTS);
    for k in 0..EVENTS {
        let turn = k as f64 * 0.1;
        let radius = 10.0 + 0.2 * k as f64;
        let mut pointer = [
            (x + radius * turn.cos() - 10.0) as i32,
            (y + radius * turn.sin()) as i32,
        ];
        while events.iter().any(|event| event.pointer == pointer) {
            pointer[0] += 1;
        }
        std::thread::sleep((begin + EVERY * k as u32).saturating_duration_since(Instant::now()));
        let at = SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs_f64();
        window.move_to(f64::from(pointer[0]), f64::from(pointer[1]));
        events.push(Event { at, pointer });
    }
    // The answers to the last events belong to the drag, too.
    std::thread::sleep(Duration::from_millis(300));
    window.release();
    window.wait("the handle to be let go of", |line| {
        line["is_dragging"] == false
    });
    Ok(events)
}

/// A frame that shows a new shape.
struct Answer {
    /// The last event that the frame answers.
    event: usize,
    /// The time when the frame was on the screen.
    at: f64,
    /// The time that the goal waited for the solver, and the time to solve.
    waited: f64,
    solved: f64,
    /// The time to draw the frame, and the time to show it.
    drawn: f64,
    shown: f64,
    /// `true` if this is the first answer to its goal.
    is_first: bool,
}

fn report(frames: &[Value], events: &[Event]) {
    let (Some(first), Some(last)) = (events.first(), events.last()) else {
        return;
    };
    let is_of_drag = |line: &&Value| {
        let begin = line["begin"].as_f64().unwrap_or_default();
        line["is_dragging"] == true && begin >= first.at
    };
    let held: Vec<&Value> = frames.iter().filter(is_of_drag).collect();
    let mut answers: Vec<Answer> = Vec::new();
    let mut tag = None;
    for (k, line) in held.iter().enumerate() {
        let pointer = numbers(&line["pointer_of_taken"]).unwrap_or_default();
        let (Some(times), [x, y]) = (numbers(&line["taken"]["times"]), pointer.as_slice()) else {
            continue;
        };
        let scale = line["pixels_per_point"].as_f64().unwrap_or(1.0);
        let pointer = [x * scale, y * scale].map(|side| side.round() as i32);
        let Some(event) = events.iter().position(|event| event.pointer == pointer) else {
            continue;
        };
        let time = |line: &Value, name: &str| line[name].as_f64().unwrap_or(f64::NAN);
        let [begin, end] = ["begin", "end"].map(|name| time(line, name));
        let at = held.get(k + 1).map_or(end, |next| time(next, "begin"));
        answers.push(Answer {
            event,
            at,
            waited: times[1] - times[0],
            solved: times[2] - times[1],
            drawn: end - begin,
            shown: at - begin,
            is_first: tag.as_ref() != Some(&line["taken"]["tag"]),
        });
        tag = Some(line["taken"]["tag"].clone());
    }
    let mut late = Vec::new();
    for (k, event) in events.iter().enumerate() {
        let answer = answers.iter().find(|answer| answer.event >= k);
        late.extend(answer.map(|answer| answer.at - event.at));
    }
    let of_first = |part: fn(&Answer) -> f64| -> Vec<f64> {
        let first = answers.iter().filter(|answer| answer.is_first);
        first.map(part).collect()
    };
    let count = late.len();
    tell(
        &format!("event to picture ({count} of {} events)", events.len()),
        late,
    );
    tell("  waiting for the solver", of_first(|a| a.waited));
    tell("  the solver", of_first(|a| a.solved));
    tell(
        "  a frame, begin to end",
        answers.iter().map(|a| a.drawn).collect(),
    );
    tell(
        "  a frame, begin to the next's",
        answers.iter().map(|a| a.shown).collect(),
    );
    let seconds = last.at - first.at;
    let in_time = |line: &&&Value| line["begin"].as_f64().is_some_and(|begin| begin <= last.at);
    let before = held.iter().filter(in_time);
    let steps = before.clone().filter_map(|line| line["steps"].as_f64());
    let steps = steps.fold(0.0, f64::max);
    println!(
        "  {:.1} iterations and {:.1} frames a second; an event every {:.1} ms",
        steps / seconds,
        before.count() as f64 / seconds,
        1e3 * seconds / (events.len() - 1) as f64,
    );
}

/// Prints the median and the 95th percentile of a list of seconds.
fn tell(name: &str, mut seconds: Vec<f64>) {
    seconds.sort_by(f64::total_cmp);
    let part = |share: f64| {
        let index = (share * seconds.len() as f64) as usize;
        let found = seconds.get(index.min(seconds.len().saturating_sub(1)));
        1e3 * found.copied().unwrap_or(f64::NAN)
    };
    println!(
        "  {name:<42} median {:7.1} ms, 95 % {:7.1} ms",
        part(0.5),
        part(0.95)
    );
}
