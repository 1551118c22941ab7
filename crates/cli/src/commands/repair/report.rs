//! The report of a repair, as JSON and as a table.

use std::collections::BTreeMap;

use cotan_io::{Change, Document, IoError, Weld};
use serde::{Serialize, Serializer};

use crate::report::{Defect, Table, listed};
use crate::text::Text;

/// The machine-readable report of a repair.
#[derive(Debug, Serialize)]
pub(crate) struct RepairReport<'a> {
    vertices: usize,
    faces: usize,
    /// One object per change.
    #[serde(serialize_with = "entries")]
    changes: &'a [Change],
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

impl<'a> RepairReport<'a> {
    /// Describes the changes, and the defects that are left.
    ///
    /// # Errors
    /// [`IoError`] if the document cannot be inspected.
    pub(crate) fn new(document: &Document, changes: &'a [Change]) -> Result<Self, IoError> {
        let defects = document.defects(Weld::AsFormat)?;
        let (defect_counts, defects) = listed(&defects, LISTED);
        Ok(Self {
            vertices: document.positions().len(),
            faces: document.faces().len(),
            changes,
            defect_counts,
            defects,
        })
    }

    /// The report as a short table.
    pub(crate) fn table(&self) -> Text {
        let mut table = Table::default();
        self.list_changes(&mut table);
        self.list_defects(&mut table);
        table.row("vertices", self.vertices);
        table.row("faces", self.faces);
        table.text
    }

    fn list_changes(&self, table: &mut Table) {
        if self.changes.is_empty() {
            table.row("changes", "none");
        }
        // The kinds in order of first occurrence.
        let mut kinds: Vec<(&str, Vec<&Change>)> = Vec::new();
        for change in self.changes {
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

    fn list_defects(&self, table: &mut Table) {
        for (kind, count) in &self.defect_counts {
            table.row(&format!("left: {kind}"), count);
            for defect in self.defects.iter().filter(|defect| defect.kind == *kind) {
                table.row("", &defect.description);
            }
            if *count > LISTED {
                table.row("", "…");
            }
        }
    }
}

/// Serializes the changes one by one: there may be as many as faces.
fn entries<S: Serializer>(changes: &[Change], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(changes.iter().map(|change| ChangeEntry {
        kind: change.kind(),
        description: change.to_string(),
    }))
}

/// The largest number of changes and defects of each kind that are printed.
const LISTED: usize = 5;
