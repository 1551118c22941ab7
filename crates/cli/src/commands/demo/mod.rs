//! `cotan demo`: deforms the built-in model and writes files to look at.
//!
//! It writes the model and its handles, then runs the same edit as `cotan deform`.

pub(crate) mod args;

use std::fmt::Write as _;

use cotan::geometry::{Mesh, Region};
use cotan::shapes::{CREATURE_RESOLUTION, creature, creature_regions};
use cotan::smooth::{SmoothOptions, smooth, with_normal_noise};
use cotan::{DeformOptions, Handles};
use cotan_io::Document;
use cotan_tool::paths::Paths;

use crate::args::{EmbedArgs, OutputFolder, Precision};
use crate::commands::deform::args::{InputArgs, RunArgs};
use crate::commands::deform::{AtLimit, DeformJob, Loose};
use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::picture::curvature_picture;
use crate::pipeline;
use crate::report::Report;
use crate::text::Text;

use args::DemoArgs;

pub(crate) fn run(args: &DemoArgs, console: &Console) -> Result<(), CliError> {
    let folder = &args.output;
    check_outputs(folder)?;
    std::fs::create_dir_all(folder).map_err(|source| CliError::Write {
        path: folder.to_path_buf(),
        source,
    })?;
    let model = creature::<f64>(CREATURE_RESOLUTION);
    let (before, handles_file) = (folder.file("before.obj"), folder.file("handles.json"));
    let input = InputArgs {
        mesh: before.as_input(),
        handles: handles_file.as_input(),
        def: None,
        output: folder.file("after.obj"),
        embed: EmbedArgs::default(),
        repair: false,
        weld: None,
        make_unique: false,
    };
    let run = RunArgs {
        precision: Precision::F64,
        threads: None,
        report: Some(folder.file("report.json")),
        history: true,
        picture: Some(folder.file("demo.png")),
    };
    let document = Document::from_mesh(model.connectivity(), model.positions())?;
    files::save(&document, &before, EmbedArgs::default(), console)?;
    files::write(&handles_file, handles().as_bytes())?;
    let job = DeformJob {
        input: &input,
        run: &run,
        options: DeformOptions::default(),
        soft: None,
        region: None,
        at_limit: AtLimit::Warn,
        loose: Loose::Refuse,
    };
    let report = pipeline::run(&job, console)?;
    smoothing(&model, folder, console)?;
    if console.is_quiet() {
        return Ok(());
    }
    let mut text = report.table();
    text.append(&where_to_look(folder));
    console.print(&text)
}

/// Writes the model with noise and smoothed, and a picture of the curvature of both.
fn smoothing(model: &Mesh<f64>, folder: &OutputFolder, console: &Console) -> Result<(), CliError> {
    let surface = model.surface();
    let noisy = with_normal_noise(&surface, NOISE * surface.mean_edge_length(), 1);
    let smoothed = smooth(
        model.surface().with_positions(&noisy),
        &Handles::new(),
        &SmoothOptions::default(),
    )
    .map_err(|source| CliError::Mesh {
        path: folder.join("noisy.obj"),
        source,
    })?;
    for (name, positions) in [("noisy.obj", &noisy), ("smoothed.obj", &smoothed.positions)] {
        let document = Document::from_mesh(model.connectivity(), positions)?;
        files::save(&document, &folder.file(name), EmbedArgs::default(), console)?;
    }
    let picture = curvature_picture(model.connectivity(), &noisy, &smoothed.positions);
    files::write(&folder.file("smoothing.png"), &picture)
}

/// Noise of the model in mean edge lengths.
const NOISE: f64 = 0.15;

/// The output files, by kind.
const OUTPUTS: [(&str, &[&str]); 4] = [
    ("pictures", &["demo.png", "smoothing.png"]),
    (
        "meshes",
        &["before.obj", "after.obj", "noisy.obj", "smoothed.obj"],
    ),
    ("handles", &["handles.json"]),
    ("report", &["report.json"]),
];

/// Fails if two of the files in the folder are the same because of links.
fn check_outputs(folder: &OutputFolder) -> Result<(), CliError> {
    let mut paths = Paths::default();
    for name in OUTPUTS.iter().flat_map(|(_, names)| *names) {
        paths.write("the output", folder.join(name));
    }
    Ok(paths.check()?)
}

fn where_to_look(folder: &OutputFolder) -> Text {
    let mut text = Text::of("");
    for (kind, names) in OUTPUTS {
        let files: Vec<String> = names
            .iter()
            .map(|name| folder.join(name).display().to_string())
            .collect();
        text.line(format_args!("{kind:<9} {}", files.join(", ")));
    }
    text
}

/// The handles file: the feet stay, the head turns to the viewer and up, the tail rises.
fn handles() -> String {
    let mut entries = Vec::new();
    for region in creature_regions::<f64>() {
        let goal = match region.name {
            "head" => HEAD,
            "tail tip" => TAIL,
            name if name.ends_with("foot") => "\"fixed\": true",
            _ => continue,
        };
        entries.push(entry(&region, goal));
    }
    format!("{{\"handles\": [\n{}\n]}}\n", entries.join(",\n"))
}

fn entry(region: &Region<f64>, goal: &str) -> String {
    let mut text = String::new();
    let [x, y, z]: [f64; 3] = region.center.into();
    // Writing to a string does not fail.
    let _ = write!(
        text,
        "  {{\"vertices\": {{\"sphere\": {{\"center\": [{x}, {y}, {z}], \"radius\": {}}}}},\n   {goal}}}",
        region.radius
    );
    text
}

const HEAD: &str = "\"transform\": {\"rotate\": {\"axis\": [0, 1, 0], \"degrees\": -50}, \
                    \"translate\": [0.1, 0.35, 0.3]}";

const TAIL: &str = "\"transform\": {\"rotate\": {\"axis\": [0, 0, 1], \"degrees\": -70}, \
                    \"translate\": [0.3, 0.75, 0.1]}";
