//! Defects of a mesh file as fields of a report.

use std::collections::BTreeMap;

use cotan_io::{Cure, Weld};
use cotan_tool::repair::weld_option;
use serde::Serialize;

/// A defect and its elements, with the indices of the file, from 0.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub(crate) struct Defect {
    pub(crate) kind: &'static str,
    pub(crate) description: String,
    pub(crate) vertices: Vec<usize>,
    pub(crate) faces: Vec<usize>,
    /// The option of `cotan repair` that cures it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) cure: Option<String>,
    #[serde(skip)]
    repair: Option<Cure>,
}

impl From<&cotan_io::Defect> for Defect {
    fn from(defect: &cotan_io::Defect) -> Self {
        let repair = defect.kind().cure();
        Self {
            kind: defect.kind().name(),
            description: defect.to_string(),
            vertices: defect.vertices(),
            faces: defect.faces(),
            cure: repair.map(|cure| cotan_tool::repair::option(cure).to_owned()),
            repair,
        }
    }
}

impl Defect {
    /// Adds the welding of the command line to the option that cures the defect.
    pub(crate) fn cure_with(&mut self, weld: Weld) {
        let Some(cure) = &mut self.cure else {
            return;
        };
        match (self.repair, weld_option(weld)) {
            (Some(Cure::Weld), option) => {
                *cure = option.unwrap_or_else(|| "--weld exact".to_owned());
            }
            (_, Some(option)) => *cure = format!("{option} {cure}"),
            (_, None) => {}
        }
    }
}

/// Counts the defects of each kind and lists the first `limit` of each.
pub(crate) fn listed(
    defects: &[cotan_io::Defect],
    limit: usize,
) -> (BTreeMap<&'static str, usize>, Vec<Defect>) {
    let (mut counts, mut listed) = (BTreeMap::new(), Vec::new());
    for defect in defects {
        let count: &mut usize = counts.entry(defect.kind().name()).or_default();
        *count += 1;
        if *count <= limit {
            listed.push(Defect::from(defect));
        }
    }
    (counts, listed)
}
