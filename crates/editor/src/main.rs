//! The program `cotan-editor`.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use cotan_editor::app::{Editor, Startup, Trace};
use cotan_io::Printable;
use cotan_workspace::files::put_aside;
use eframe::egui;

/// Edit a triangle mesh by hand: drag a handle, and the surface follows with its details turned
/// and scaled.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    /// The mesh (.obj, .ply, .off, .stl, .gltf or .glb, also with .gz behind) or project (.cotan);
    /// a sample without one.
    mesh: Option<PathBuf>,
    /// Handles to begin with, as `cotan deform` takes them.
    #[arg(long, value_name = "FILE", requires = "mesh")]
    handles: Option<PathBuf>,
    /// Begin in a window of this size, in points.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size, default_value = "1280x800")]
    size: [f32; 2],
    /// Write one line of JSON per frame, with positions of widgets and timings. For tests.
    #[arg(long, value_name = "FILE", hide = true)]
    trace: Option<PathBuf>,
    /// Let Ctrl Shift F11 and F12 break the program. For tests.
    #[arg(long, hide = true)]
    breakable: bool,
}

fn size(text: &str) -> Result<[f32; 2], String> {
    let problem = || format!("\"{text}\" is no size like 1280x800");
    let (width, height) = text.split_once('x').ok_or_else(problem)?;
    let side = |text: &str| {
        let side = text.parse::<u16>().ok().filter(|side| *side >= 100);
        side.map(f32::from).ok_or_else(problem)
    };
    Ok([side(width)?, side(height)?])
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    save_on_panic();
    if let Err(error) = cotan_tool::interrupt::remove_files_on_signals() {
        eprintln!("warning: a signal may leave a temporary file behind: {error}");
    }
    // A missing system library may cause a panic while the window is opened.
    let outcome = catch_unwind(AssertUnwindSafe(|| run(arguments)));
    match outcome {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(problem)) => {
            eprintln!("error: {}", Printable(problem));
            ExitCode::FAILURE
        }
        Err(_) => {
            eprintln!("error: the editor crashed; start it again to recover unsaved work");
            ExitCode::from(101)
        }
    }
}

/// Completes the journal before a panic is reported, in any thread.
fn save_on_panic() {
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        match put_aside() {
            Some(Ok(path)) => eprintln!("your work was put aside in {}", Printable(path.display())),
            Some(Err(error)) => {
                eprintln!(
                    "your work could not be put aside in full: {}",
                    Printable(error)
                );
            }
            None => {}
        }
        tell(info);
    }));
}

fn run(arguments: Arguments) -> Result<(), String> {
    let trace = match &arguments.trace {
        Some(path) => Some(Trace::create(path).map_err(|e| format!("{}: {e}", path.display()))?),
        None => None,
    };
    let startup = Startup {
        mesh: arguments.mesh,
        handles: arguments.handles,
        trace,
        breakable: arguments.breakable,
    };
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("cotan")
            .with_app_id("cotan-editor")
            .with_inner_size(arguments.size)
            .with_min_inner_size([640.0, 480.0])
            .with_drag_and_drop(true),
        depth_buffer: 24,
        ..eframe::NativeOptions::default()
    };
    let made = Box::new(|cc: &eframe::CreationContext<'_>| {
        let editor = Editor::new(cc, startup)?;
        Ok(Box::new(editor) as Box<dyn eframe::App>)
    });
    eframe::run_native("cotan", options, made).map_err(|error| no_window(&error))
}

/// Explains why there is no window, without the source locations that the libraries add.
fn no_window(error: &eframe::Error) -> String {
    let problem = match error {
        eframe::Error::AppCreation(problem) => problem.to_string(),
        eframe::Error::Winit(_) | eframe::Error::WinitEventLoop(_) => {
            "no X11 or Wayland display answers (is DISPLAY or WAYLAND_DISPLAY set, and libX11 there?)"
                .to_owned()
        }
        other => other.to_string(),
    };
    format!(
        "cannot open a window: {problem}. The editor needs an X11 or Wayland display and OpenGL 3.3 \
         or later (Mesa's software renderer works)"
    )
}
