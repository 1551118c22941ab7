//! `cotan repair`: what can be done about a mesh without guessing a shape.

use std::collections::BTreeMap;

use cotan_io::{Change, Document, Format, Weld};
use serde::Serialize;

use crate::args::RepairArgs;
use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::inspect::{Defect, listed};
use crate::report::{Table, write_json};

/// What was done, for programs.
#[derive(Debug, Serialize)]
struct Report {
    vertices: usize,
    faces: usize,
    changes: Vec<ChangeEntry>,
    /// How many defects of each kind are left.
    defect_counts: BTreeMap<&'static str, usize>,
    /// The first of each kind.
    defects: Vec<Defect>,
}

#[derive(Debug, Serialize)]
struct ChangeEntry {
    kind: &'static str,
    description: String,
}

pub(crate) fn run(args: &RepairArgs, console: &Console) -> Result<(), CliError> {
    let format = files::mesh_format(&args.output)?;
    let document = files::load(&args.input, console)?;
    let in_file = |error| files::in_file(&args.input, error);
    let repaired = args.repair().apply(&document).map_err(in_file)?;
    files::save(&repaired.document, &args.output)?;
    for loss in repaired.document.losses(format) {
        console.warn(format_args!("{}: {loss}", args.output.display()));
    }
    for forgotten in forgotten(format, &repaired.changes) {
        console.warn(format_args!("{}: {forgotten}", args.output.display()));
    }
    let defects = repaired.document.defects(Weld::AsFormat).map_err(in_file)?;
    let (defect_counts, defects) = listed(&defects, LISTED);
    if let Some(path) = &args.report {
        let report = Report {
            vertices: repaired.document.positions().len(),
            faces: repaired.document.faces().len(),
            changes: repaired.changes.iter().map(entry).collect(),
            defect_counts: defect_counts.clone(),
            defects: defects.clone(),
        };
        write_json(path, &report)?;
    }
    if console.is_quiet() {
        return Ok(());
    }
    let mut table = Table::default();
    tell(&repaired.changes, &mut table);
    left(&defect_counts, &defects, &mut table);
    counts(&repaired.document, &mut table);
    console.print(&table.text)
}

/// How many changes and defects of a kind are told.
const LISTED: usize = 5;

/// What a repair did that a file in `format` cannot tell, for warnings.
pub(crate) fn forgotten(format: Format, changes: &[Change]) -> Vec<String> {
    let is_parting = |change: &Change| {
        matches!(
            change,
            Change::SplitVertex { .. } | Change::PartedPlace { .. } | Change::DetachedFace { .. }
        )
    };
    let is_merging = |change: &Change| matches!(change, Change::MergedVertex { .. });
    let is_gltf = matches!(format, Format::Gltf | Format::Glb);
    let mut forgotten = Vec::new();
    if (is_gltf || format == Format::Stl) && changes.iter().any(is_parting) {
        let unless = if is_gltf {
            ", unless with --weld off"
        } else {
            ""
        };
        forgotten.push(format!(
            "{format} stores positions, not which vertices are one; what was parted at the same \
             position meets again when the file is read{unless}"
        ));
    }
    if is_gltf && changes.iter().any(is_merging) {
        forgotten.push(format!(
            "{format} keeps its vertices where they are; those that were merged within a distance \
             are apart again when the file is read, unless with the same --weld"
        ));
    }
    forgotten
}

fn entry(change: &Change) -> ChangeEntry {
    ChangeEntry {
        kind: change.kind(),
        description: change.to_string(),
    }
}

fn tell(changes: &[Change], table: &mut Table) {
    if changes.is_empty() {
        table.row("changes", "none");
    }
    // Kinds in the order in which they first come.
    let mut kinds: Vec<(&str, Vec<&Change>)> = Vec::new();
    for change in changes {
        match kinds.iter_mut().find(|(kind, _)| *kind == change.kind()) {
            Some((_, of_kind)) => of_kind.push(change),
            None => kinds.push((change.kind(), vec![change])),
        }
    }
    for (kind, of_kind) in kinds {
        table.row(kind, of_kind.len());
        of_kind
            .iter()
            .take(LISTED)
            .for_each(|change| table.row("", change));
        if of_kind.len() > LISTED {
            table.row("", "…");
        }
    }
}

fn left(counts: &BTreeMap<&'static str, usize>, defects: &[Defect], table: &mut Table) {
    for (kind, count) in counts {
        table.row(&format!("left: {kind}"), count);
        for defect in defects.iter().filter(|defect| defect.kind == *kind) {
            table.row("", &defect.description);
        }
        if *count > LISTED {
            table.row("", "…");
        }
    }
}

fn counts(document: &Document, table: &mut Table) {
    table.row("vertices", document.positions().len());
    table.row("faces", document.faces().len());
}
