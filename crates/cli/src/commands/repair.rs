//! `cotan repair`: repairs a mesh as far as possible without guessing a shape.

use std::collections::BTreeMap;

use cotan_io::{Change, Document, Format, Weld};
use cotan_tool::Work;
use cotan_tool::repair::mend;
use serde::Serialize;

use crate::args::RepairArgs;
use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::inspect::{Defect, listed};
use crate::memory;
use crate::prepare::warn_unfair;
use crate::report::{Table, write_json};

/// The machine-readable report of a repair.
#[derive(Debug, Serialize)]
struct Report {
    vertices: usize,
    faces: usize,
    changes: Vec<ChangeEntry>,
    /// The number of remaining defects of each kind.
    defect_counts: BTreeMap<&'static str, usize>,
    /// The first defects of each kind.
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
    memory::check(Work::Repair, &args.input, &document)?;
    let in_file = |error| files::in_file(&args.input, error);
    let mended = mend(&args.repair(), &document).map_err(in_file)?;
    if let Some(problem) = &mended.unfair {
        warn_unfair(&args.input, problem, console);
    }
    let repaired = mended.repaired;
    files::save(&repaired.document, &args.output, args.embed, console)?;
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

/// The largest number of changes and defects of each kind that are printed.
const LISTED: usize = 5;

/// The changes of a repair that a file in `format` cannot express, for warnings.
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
    // The kinds in order of first occurrence.
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
