//! Makes the README's pictures of the editor with its sample: `pictures FOLDER`.
//!
//! They are made with real events, like the tests of the window. Run by
//! `scripts/editor-pictures.sh`.

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use cotan::shapes::creature_regions;

#[allow(dead_code, reason = "the tests of the window need more of it")]
#[path = "../tests/window/harness.rs"]
mod harness;

use harness::{Display, Start, Window, project};

fn main() -> Result<(), Box<dyn Error>> {
    if let Some(problem) = harness::missing_tools() {
        return Err(problem.into());
    }
    let folder = std::env::args_os().nth(1).ok_or("usage: pictures FOLDER")?;
    let folder = PathBuf::from(folder);
    std::fs::create_dir_all(&folder)?;
    let example = std::env::current_exe()?;
    let beside = example.parent().and_then(Path::parent);
    let program = beside.map(|beside| beside.join("cotan-editor"));
    let program = program.filter(|program| program.is_file());
    let program = program.ok_or("build the program beside this: --bins")?;
    bend(&program, &folder)?;
    smooth_and_map(&program, &folder)
}

/// Opens the window on the sample, zoomed to fill the view.
fn open<'d>(display: &'d mut Display, program: &Path, data: &Path) -> Window<'d> {
    let start = Start {
        program,
        data,
        arguments: Vec::new(),
    };
    let mut window = Window::open(display, &start);
    window.wait_for_mesh();
    let [left, top, right, bottom] = window.rect("viewport");
    window.move_to(0.5 * (left + right), 0.5 * (top + bottom) + 40.0);
    window.display.order("click 4");
    at_rest(&mut window);
    window
}

fn bend(program: &Path, folder: &Path) -> Result<(), Box<dyn Error>> {
    let data = tempfile::tempdir()?;
    let mut display = Display::start();
    let mut window = open(&mut display, program, data.path());
    let feet = [
        "front left foot",
        "front right foot",
        "hind left foot",
        "hind right foot",
    ];
    paint(&mut window, &feet)?;
    hold(&mut window, "x", 1);
    paint(&mut window, &["head"])?;
    hold(&mut window, "h", 2);
    paint(&mut window, &["tail tip"])?;
    hold(&mut window, "h", 3);
    window.key("q");
    window.drag(2, [190.0, -70.0], 40);
    window.wait_for_rest();
    window.drag(1, [-270.0, 10.0], 40);
    window.wait_for_rest();
    choose_colours(&mut window, 2);
    save(&window, &folder.join("editor-deform.png"))?;

    Ok(())
}

fn smooth_and_map(program: &Path, folder: &Path) -> Result<(), Box<dyn Error>> {
    let data = tempfile::tempdir()?;
    let mut display = Display::start();
    let mut window = open(&mut display, program, data.path());
    choose_colours(&mut window, 1);
    window.click_on("tab-smooth");
    window.click_on("smooth");
    window.wait("the smooth shape", |line| {
        line["label"] == "Smooth" && line["task"].is_null()
    });
    at_rest(&mut window);
    save(&window, &folder.join("editor-smooth.png"))?;

    choose_colours(&mut window, 4);
    window.click_on("tab-sphere");
    window.click_on("map");
    window.wait("the sphere", |line| line["morph"] == 1.0);
    let [left, top, _, bottom] = window.rect("morph");
    window.move_to(left + 75.0, 0.5 * (top + bottom));
    window.press();
    window.wait("a shape between", |line| {
        line["morph"].as_f64().is_some_and(|share| share < 1.0)
    });
    window.release();
    at_rest(&mut window);
    save(&window, &folder.join("editor-sphere.png"))?;
    Ok(())
}

/// Paints the visible surface of parts of the sample with the brush.
fn paint(window: &mut Window<'_>, parts: &[&str]) -> Result<(), Box<dyn Error>> {
    window.key("b");
    let regions = creature_regions::<f64>();
    window.display.order("keydown shift");
    for part in parts {
        let region = regions.iter().find(|region| region.name == *part);
        let center = region.ok_or("no such part")?.center;
        let line = window.now();
        let [x, y, _] = project(&line, center.into()).ok_or("it is not seen")?;
        let before = line["selected"].as_u64();
        window.move_to(x, y);
        window.press();
        window.wait("the brush", |line| line["selected"].as_u64() > before);
        for k in 0..12 {
            let turn = f64::from(k) / 12.0 * std::f64::consts::TAU;
            window.move_to(x + 12.0 * turn.cos(), y + 12.0 * turn.sin());
            std::thread::sleep(Duration::from_millis(30));
        }
        window.release();
        at_rest(window);
    }
    window.display.order("keyup shift");
    Ok(())
}

/// Makes a handle of the selection and waits until there are `count` handles.
fn hold(window: &mut Window<'_>, key: &str, count: usize) {
    window.key(key);
    window.wait("a handle", |line| {
        line["handles"].as_array().is_some_and(|h| h.len() == count)
    });
}

fn choose_colours(window: &mut Window<'_>, index: usize) {
    window.click_on("colours");
    window.click_on(&format!("colours-{index}"));
    at_rest(window);
}

/// Waits until no more frames are drawn.
fn at_rest(window: &mut Window<'_>) {
    let mut last = (0, Instant::now());
    while last.1.elapsed() < Duration::from_millis(700) {
        let count = window.frames().len();
        if count != last.0 {
            last = (count, Instant::now());
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn save(window: &Window<'_>, path: &Path) -> Result<(), Box<dyn Error>> {
    let (width, height, colors) = window.picture();
    let mut encoder = png::Encoder::new(BufWriter::new(File::create(path)?), width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&colors)?;
    writer.finish()?;
    Ok(())
}
