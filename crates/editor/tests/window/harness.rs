//! Runs the real program on a private display, with a real pointer and keys.
//!
//! The program's state is read from the lines of `--trace`; the program is steered by X events
//! alone.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use nalgebra::Point3;
use serde_json::Value;
use x11rb::protocol::xproto::{ClientMessageEvent, ConnectionExt, EventMask, ImageFormat};

/// The timeout of every wait, generous enough for a busy machine.
pub(crate) const DEADLINE: Duration = Duration::from_secs(60);

/// The tools missing on this machine, as a sentence for the user.
pub(crate) fn missing_tools() -> Option<String> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let is_there = |tool: &str| std::env::split_paths(&path).any(|dir| dir.join(tool).is_file());
    let missing: Vec<&str> = ["Xvfb", "xdotool"]
        .into_iter()
        .filter(|tool| !is_there(tool))
        .collect();
    (!missing.is_empty()).then(|| {
        format!(
            "{} not found; scripts/editor-tools.sh installs what the editor's window is tested with",
            missing.join(" and ")
        )
    })
}

/// An X server without a screen, and a process that sends events to it.
pub(crate) struct Display {
    server: Child,
    hand: Child,
    orders: ChildStdin,
    name: String,
}

impl Display {
    /// Starts both on an unused display.
    pub(crate) fn start() -> Self {
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1280x800x24"])
            .args(["-nolisten", "tcp", "-dpi", "96"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts");
        let mut number = String::new();
        let output = server.stdout.take().expect("it was asked for");
        BufReader::new(output)
            .read_line(&mut number)
            .expect("Xvfb tells its display");
        let number = number.trim();
        assert!(!number.is_empty(), "Xvfb found no display for itself");
        let name = format!(":{number}");
        let mut hand = Command::new("xdotool")
            .arg("-")
            .env("DISPLAY", &name)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .expect("xdotool starts");
        let orders = hand.stdin.take().expect("it was asked for");
        Self {
            server,
            hand,
            orders,
            name,
        }
    }

    /// The value for the environment variable `DISPLAY`.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Runs an xdotool command. Commands run in order.
    pub(crate) fn order(&mut self, command: &str) {
        writeln!(self.orders, "{command}")
            .and_then(|()| self.orders.flush())
            .expect("xdotool listens");
    }

    /// Runs an xdotool query and returns its answer.
    fn ask(&self, question: &[&str]) -> String {
        let output = Command::new("xdotool")
            .args(question)
            .env("DISPLAY", &self.name)
            .stderr(Stdio::null())
            .output()
            .expect("xdotool starts");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        for child in [&mut self.hand, &mut self.server] {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// The parameters to start the program with.
pub(crate) struct Start<'a> {
    /// The program.
    pub(crate) program: &'a Path,
    /// The folder for autosaves and for the trace.
    pub(crate) data: &'a Path,
    /// Further arguments.
    pub(crate) arguments: Vec<String>,
}

/// The program's window.
pub(crate) struct Window<'d> {
    /// The display that shows it.
    pub(crate) display: &'d mut Display,
    child: Child,
    /// The X window id.
    pub(crate) id: String,
    errors: PathBuf,
    trace: BufReader<File>,
    partial: String,
    lines: Vec<Value>,
}

impl<'d> Window<'d> {
    /// Starts the program and waits for its first frame.
    pub(crate) fn open(display: &'d mut Display, start: &Start<'_>) -> Self {
        let trace = start.data.join("trace.jsonl");
        let errors = start.data.join("stderr.txt");
        File::create(&trace).expect("a file in a folder of one's own");
        let child = command(start.program, start.data)
            .arg("--trace")
            .arg(&trace)
            .args(&start.arguments)
            .env("DISPLAY", display.name())
            .stderr(File::create(&errors).expect("a file in a folder of one's own"))
            .spawn()
            .expect("the editor starts");
        let mut window = Self {
            display,
            child,
            id: String::new(),
            errors,
            trace: BufReader::new(File::open(&trace).expect("made above")),
            partial: String::new(),
            lines: Vec::new(),
        };
        window.wait("its first frame", |line| line["frame"].is_u64());
        let deadline = Instant::now() + DEADLINE;
        while window.id.is_empty() {
            assert!(Instant::now() < deadline, "no window was found");
            let found = window
                .display
                .ask(&["search", "--onlyvisible", "--class", "cotan-editor"]);
            window.id = found.lines().next().unwrap_or_default().to_owned();
        }
        // There is no window manager to do this.
        let order = format!("windowmove {} 0 0", window.id);
        window.display.order(&order);
        let order = format!("windowfocus {}", window.id);
        window.display.order(&order);
        window
    }

    /// The program's output on stderr.
    pub(crate) fn errors(&self) -> String {
        std::fs::read_to_string(&self.errors).unwrap_or_default()
    }

    /// All frames so far.
    pub(crate) fn frames(&mut self) -> &[Value] {
        self.read();
        &self.lines
    }

    /// The last frame.
    pub(crate) fn now(&mut self) -> Value {
        self.read();
        self.lines.last().cloned().unwrap_or_default()
    }

    /// Reads the complete lines written so far.
    fn read(&mut self) {
        loop {
            let read = self.trace.read_line(&mut self.partial);
            if read.expect("the trace is text") == 0 || !self.partial.ends_with('\n') {
                return;
            }
            let line = serde_json::from_str(&self.partial).expect("a line of the trace is JSON");
            self.lines.push(line);
            self.partial.clear();
        }
    }

    /// Waits until the last frame satisfies a condition, and returns it.
    pub(crate) fn wait(&mut self, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
        let deadline = Instant::now() + DEADLINE;
        loop {
            let line = self.now();
            if is_so(&line) {
                return line;
            }
            if Instant::now() > deadline {
                panic!("waited in vain for {what}; {}", self.told(&line));
            }
            if let Ok(Some(status)) = self.child.try_wait() {
                panic!("ended ({status}) before {what}; {}", self.told(&line));
            }
            std::thread::sleep(Duration::from_millis(4));
        }
    }

    fn told(&self, line: &Value) -> String {
        format!("the last frame: {line}\nstderr: {}", self.errors())
    }

    /// Waits for a dialog whose name or text contains `part`.
    pub(crate) fn wait_for_dialog(&mut self, part: &str) -> Value {
        self.wait(&format!("the dialog \"{part}\""), |line| {
            text(line, "dialog").contains(part)
        })
    }

    /// Waits until no dialog is open.
    pub(crate) fn wait_for_no_dialog(&mut self) -> Value {
        self.wait("no dialog", |line| text(line, "dialog").is_empty())
    }

    /// Waits until a mesh is open and no task is running.
    pub(crate) fn wait_for_mesh(&mut self) -> Value {
        self.wait("a mesh", |line| {
            line["task"].is_null() && !line["path"].is_null() && !line["view"].is_null()
        })
    }

    /// Waits until the shape has settled.
    pub(crate) fn wait_for_rest(&mut self) -> Value {
        self.wait("rest", |line| {
            line["state"] == "settled" && line["is_settled"] == true && line["is_dragging"] == false
        })
    }

    /// The rectangle of a widget once it has stopped moving: `[left, top, right, bottom]`.
    pub(crate) fn rect(&mut self, name: &str) -> [f64; 4] {
        let deadline = Instant::now() + DEADLINE;
        let mut last = (None, Instant::now());
        loop {
            let line = self.now();
            let rect = numbers(&line["widgets"][name]);
            // A dialog is measured in its first frame and positioned in the next.
            if rect != last.0 {
                last = (rect, Instant::now());
            } else if let Some(rect) = &last.0
                && last.1.elapsed() > Duration::from_millis(150)
            {
                return [rect[0], rect[1], rect[2], rect[3]];
            }
            if Instant::now() > deadline {
                panic!("waited in vain for {name}; {}", self.told(&line));
            }
            std::thread::sleep(Duration::from_millis(4));
        }
    }

    /// Moves the pointer to a position in points.
    pub(crate) fn move_to(&mut self, x: f64, y: f64) {
        let scale = self.now()["pixels_per_point"].as_f64().unwrap_or(1.0);
        let order = format!("mousemove {:.0} {:.0}", x * scale, y * scale);
        self.display.order(&order);
    }

    /// Presses the left button.
    pub(crate) fn press(&mut self) {
        self.display.order("mousedown 1");
    }

    /// Releases the left button.
    pub(crate) fn release(&mut self) {
        self.display.order("mouseup 1");
    }

    /// Clicks with the left button.
    pub(crate) fn click(&mut self, x: f64, y: f64) {
        self.move_to(x, y);
        self.press();
        self.release();
    }

    /// Clicks the centre of a widget.
    pub(crate) fn click_on(&mut self, name: &str) {
        let [left, top, right, bottom] = self.rect(name);
        self.click(0.5 * (left + right), 0.5 * (top + bottom));
    }

    /// Presses a key combination in xdotool's notation: `ctrl+shift+s`.
    pub(crate) fn key(&mut self, keys: &str) {
        self.display.order(&format!("key {keys}"));
    }

    /// Asks the window to close, as the close button of a window frame does.
    pub(crate) fn ask_to_close(&mut self) {
        ask_to_close(self.display.name(), self.id.parse().expect("a number"))
            .expect("the X server listens");
    }

    /// The contents of the window: width, height, and the RGB values of every pixel.
    pub(crate) fn picture(&self) -> (u32, u32, Vec<u8>) {
        let window = self.id.parse().expect("a number");
        picture(self.display.name(), window).expect("the X server listens")
    }

    /// The peak memory of the program in bytes, if the system reports it.
    pub(crate) fn peak_memory(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).ok()?;
        let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
        let kilobytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
        Some(kilobytes << 10)
    }

    /// Waits until the program ends.
    pub(crate) fn wait_for_end(&mut self) -> ExitStatus {
        let deadline = Instant::now() + DEADLINE;
        loop {
            if let Some(status) = self.child.try_wait().expect("it is a child") {
                return status;
            }
            if Instant::now() > deadline {
                let line = self.now();
                panic!("the program does not end; {}", self.told(&line));
            }
            std::thread::sleep(Duration::from_millis(4));
        }
    }

    /// Kills the program, as `kill -9` does.
    pub(crate) fn kill(&mut self) {
        self.child.kill().expect("it runs");
        self.child.wait().expect("it is a child");
    }

    /// Clicks visible vertices until one is selected, in order of `rank` of their window
    /// positions.
    ///
    /// Returns its index in the file.
    pub(crate) fn select(
        &mut self,
        positions: &[Point3<f64>],
        rank: impl Fn([f64; 3]) -> f64,
    ) -> usize {
        let line = self.now();
        let all = positions.iter().enumerate();
        let mut seen: Vec<(usize, [f64; 3])> = all
            .filter_map(|(v, p)| Some((v, project(&line, [p.x, p.y, p.z])?)))
            .collect();
        seen.sort_by(|a, b| rank(a.1).total_cmp(&rank(b.1)));
        for (vertex, [x, y, _]) in seen.into_iter().step_by(7).take(60) {
            if self.now()["selected"] != 0 {
                self.key("Escape");
                self.wait("nothing selected", |line| line["selected"] == 0);
            }
            self.click(x.round(), y.round());
            let patience = Instant::now() + Duration::from_secs(2);
            while Instant::now() < patience {
                let selection = numbers(&self.now()["selection"]).unwrap_or_default();
                match selection.as_slice() {
                    [] => std::thread::sleep(Duration::from_millis(4)),
                    [one] if *one == vertex as f64 => return vertex,
                    // The vertex is behind the surface, or another one is nearer to the pointer.
                    _ => break,
                }
            }
        }
        panic!("no vertex lets itself be selected: {}", self.now());
    }

    /// Fixes `fixed` single vertices and makes a handle at the upper end of the picture.
    ///
    /// Returns their indices in the file, the handle's last. The fixed vertices are at the lower
    /// end, on the left and on the right, in this order.
    pub(crate) fn hold(&mut self, positions: &[Point3<f64>], fixed: usize) -> Vec<usize> {
        let ranks: [fn([f64; 3]) -> f64; 3] = [|[_, y, _]| -y, |[x, ..]| x, |[x, ..]| -x];
        let mut held = Vec::new();
        for rank in ranks.into_iter().take(fixed) {
            held.push(self.select(positions, rank));
            self.press_and_count("x", held.len());
        }
        held.push(self.select(positions, |[_, y, _]| y));
        self.press_and_count("h", held.len());
        held
    }

    /// Presses a key that makes a handle, and waits until there are `count` handles.
    fn press_and_count(&mut self, key: &str, count: usize) {
        self.key(key);
        self.wait("a handle", |line| {
            line["handles"].as_array().is_some_and(|h| h.len() == count)
        });
    }

    /// The position of a handle.
    pub(crate) fn handle_at(&mut self, handle: usize) -> [f64; 3] {
        let at = numbers(&self.now()["handles"][handle]["at"]);
        let at = at.unwrap_or_else(|| panic!("there is no handle {handle}"));
        [at[0], at[1], at[2]]
    }

    /// Drags a handle by its mark, in `steps` events, by the distance `by` in points, and
    /// releases it.
    pub(crate) fn drag(&mut self, handle: usize, by: [f64; 2], steps: u32) {
        let at = self.handle_at(handle);
        let [x, y, _] = project(&self.now(), at).expect("the handle is seen");
        self.move_to(x, y);
        self.press();
        for k in 1..=steps {
            let share = f64::from(k) / f64::from(steps);
            // Along a curve, because the path must not matter.
            let swing = 30.0 * (share * std::f64::consts::PI).sin();
            self.move_to(x + share * by[0] + swing, y + share * by[1]);
            std::thread::sleep(Duration::from_millis(16));
        }
        self.wait("the handle to have followed", |line| {
            line["is_dragging"] == true
                && numbers(&line["handles"][handle]["at"]) != Some(at.to_vec())
        });
        self.release();
        self.wait("the handle to be let go of", |line| {
            line["is_dragging"] == false
        });
    }
}

impl Drop for Window<'_> {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends the message that a window manager would send.
fn ask_to_close(display: &str, window: u32) -> Result<(), Box<dyn std::error::Error>> {
    let (connection, _) = x11rb::connect(Some(display))?;
    let atom = |name: &str| connection.intern_atom(false, name.as_bytes());
    let protocols = atom("WM_PROTOCOLS")?;
    let delete = atom("WM_DELETE_WINDOW")?;
    let data = [delete.reply()?.atom, x11rb::CURRENT_TIME, 0, 0, 0];
    let message = ClientMessageEvent::new(32, window, protocols.reply()?.atom, data);
    connection
        .send_event(false, window, EventMask::NO_EVENT, message)?
        .check()?;
    Ok(())
}

fn picture(display: &str, window: u32) -> Result<(u32, u32, Vec<u8>), Box<dyn std::error::Error>> {
    let (connection, _) = x11rb::connect(Some(display))?;
    let size = connection.get_geometry(window)?.reply()?;
    let (width, height) = (size.width, size.height);
    let image = connection
        .get_image(ImageFormat::Z_PIXMAP, window, 0, 0, width, height, u32::MAX)?
        .reply()?;
    // 24 bits per pixel in four bytes, least significant first; both sides run on this machine.
    let pixels = image.data.chunks_exact(4);
    let colors = pixels.flat_map(|pixel| [pixel[2], pixel[1], pixel[0]]);
    Ok((width.into(), height.into(), colors.collect()))
}

/// The program with the environment of a test: software OpenGL, no other display, its own data.
pub(crate) fn command(program: &Path, data: &Path) -> Command {
    let mut command = Command::new(program);
    command
        .env("COTAN_EDITOR_DATA", data)
        .env("LIBGL_ALWAYS_SOFTWARE", "1")
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .stdin(Stdio::null())
        .stdout(Stdio::null());
    command
}

/// Returns a text field.
pub(crate) fn text<'a>(line: &'a Value, field: &str) -> &'a str {
    line[field].as_str().unwrap_or_default()
}

/// Returns a list of numbers.
pub(crate) fn numbers(value: &Value) -> Option<Vec<f64>> {
    value.as_array()?.iter().map(Value::as_f64).collect()
}

/// The position of a point of the mesh in the window of this frame, in points, and its depth.
pub(crate) fn project(line: &Value, point: [f64; 3]) -> Option<[f64; 3]> {
    let m = numbers(&line["view"])?;
    let rect = numbers(&line["widgets"]["viewport"])?;
    let row = |k: usize| {
        m[4 * k] * point[0] + m[4 * k + 1] * point[1] + m[4 * k + 2] * point[2] + m[4 * k + 3]
    };
    let w = row(3);
    let [x, y, z] = [row(0) / w, row(1) / w, row(2) / w];
    let at_x = rect[0] + 0.5 * (x + 1.0) * (rect[2] - rect[0]);
    let at_y = rect[1] + 0.5 * (1.0 - y) * (rect[3] - rect[1]);
    let is_inside = w > 0.0 && x.abs() < 0.95 && y.abs() < 0.95;
    is_inside.then_some([at_x, at_y, z])
}

/// Returns the contents of a file.
pub(crate) fn bytes(path: &Path) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut file = File::open(path).expect("the file is there");
    file.read_to_end(&mut bytes).expect("the file can be read");
    bytes
}
