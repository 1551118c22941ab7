//! `cotan info`: describes the contents of a mesh file.

pub(crate) mod args;
mod inspect;

use cotan_tool::Work;

use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::memory;
use crate::report::{Table, json_text, number};
use crate::text::Text;

use args::InfoArgs;
use inspect::{ComponentPart, Inspection, inspect};

pub(crate) fn run(args: &InfoArgs, console: &Console) -> Result<(), CliError> {
    let document = files::load(&args.mesh, console)?;
    memory::check(Work::Inspect, &args.mesh, &document)?;
    let name = args.mesh.display().to_string();
    let weld = args.weld.unwrap_or_default();
    let mut inspection = inspect(name, &document, weld, args.limit)
        .map_err(|error| files::in_file(&args.mesh, error))?;
    inspection.cure_with(weld);
    if args.json {
        return console.print(&json_text(&inspection)?);
    }
    console.print(&table(&inspection))
}

fn table(info: &Inspection) -> Text {
    let mut table = Table::default();
    let format = info.format.as_deref().unwrap_or("no format");
    table.row("file", format_args!("{} ({format})", info.file));
    let unused = match info.unreferenced_vertices {
        0 => String::new(),
        n => format!(" ({n} in no face)"),
    };
    table.row("vertices", format_args!("{}{unused}", info.vertices));
    table.row("faces", faces(info));
    let boundary = match info.boundary_edges {
        0 => String::new(),
        n => format!(" ({n} on the boundary)"),
    };
    table.row("edges", format_args!("{}{boundary}", info.edges));
    for part in &info.parts {
        table.row(
            "part",
            format_args!(
                "{} ({} vertices, {} faces)",
                part.name, part.vertices, part.faces
            ),
        );
    }
    for name in &info.attributes {
        table.row("attribute", name);
    }
    table.row("components", info.components);
    for part in info.component_parts.iter().take(LISTED_PARTS) {
        table.row("", component_part(part));
    }
    if info.component_parts.len() > LISTED_PARTS {
        table.row("", "…");
    }
    table.row("manifold", yes_no(info.manifold));
    table.row("closed", yes_no(info.closed));
    if let Some(loops) = info.boundary_loops {
        table.row("boundary loops", loops);
    }
    if let Some(genus) = info.genus {
        table.row("genus", genus);
    }
    table.row("Euler characteristic", info.euler_characteristic);
    let bounds = &info.bounding_box;
    let corner = |p: [f64; 3]| p.map(number).join(" ");
    table.row(
        "bounding box",
        format_args!("{} to {}", corner(bounds.min), corner(bounds.max)),
    );
    table.row("diagonal", number(bounds.diagonal));
    shape(info, &mut table);
    if let Some(weldable) = &info.weldable {
        table.row("weldable", weldable);
    }
    if let Some(problem) = &info.problem {
        table.row("problem", problem);
    }
    for (kind, count) in &info.defect_counts {
        let of_kind = info.defects.iter().filter(|defect| defect.kind == *kind);
        match of_kind.clone().find_map(|defect| defect.cure.as_deref()) {
            Some(cure) => table.row(kind, format_args!("{count} (cotan repair {cure})")),
            None => table.row(kind, count),
        }
        for defect in of_kind.take(LISTED) {
            table.row("", &defect.description);
        }
        if *count > LISTED {
            table.row("", "…");
        }
    }
    table.text
}

/// Components that the table shows; JSON lists all.
const LISTED_PARTS: usize = 20;

/// A component in words.
fn component_part(part: &ComponentPart) -> String {
    let name = match part.name.as_str() {
        "" => String::new(),
        name => format!(" {name}"),
    };
    let follows: Vec<String> = part.follows.iter().map(ToString::to_string).collect();
    let follows = match follows.len() {
        0 => String::new(),
        _ => format!(", follows {}", follows.join(", ")),
    };
    format!("{}{name}: {} vertices{follows}", part.part, part.vertices)
}

/// Defects of each kind that the table shows; JSON lists more.
const LISTED: usize = 5;

fn faces(info: &Inspection) -> String {
    let kinds: Vec<String> = info
        .corners
        .iter()
        .map(|(corners, count)| match corners {
            3 => format!("{count} triangles"),
            4 => format!("{count} quads"),
            n => format!("{count} with {n} corners"),
        })
        .collect();
    let cut = match info.corners.keys().any(|&corners| corners > 3) {
        true => format!("; {} triangles when cut", info.triangles),
        false => String::new(),
    };
    match info.corners.len() {
        0 => "0".to_owned(),
        _ => format!("{} ({}{cut})", info.faces, kinds.join(", ")),
    }
}

fn shape(info: &Inspection, table: &mut Table) {
    if let Some(area) = info.area {
        table.row("area", number(area));
    }
    if let Some(volume) = info.volume {
        table.row("volume", number(volume));
    }
    if let Some(angles) = &info.angles {
        table.row(
            "angles",
            format_args!(
                "{:.2}° to {:.2}° (smallest of a face: {:.2}° on average)",
                angles.min_degrees, angles.max_degrees, angles.mean_smallest_degrees
            ),
        );
    }
    if let Some(lengths) = &info.edge_lengths {
        let [min, mean, max] = [lengths.min, lengths.mean, lengths.max].map(number);
        table.row(
            "edge lengths",
            format_args!("{min} to {max} ({mean} on average)"),
        );
    }
    if let Some(share) = info.negative_cotangent_share {
        table.row(
            "negative cotangents",
            format_args!("{:.3} % of the edges", share * 100.0),
        );
    }
    table.row("degenerate faces", info.degenerate_faces);
}

fn yes_no(answer: bool) -> &'static str {
    if answer { "yes" } else { "no" }
}
