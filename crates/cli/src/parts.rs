//! The parts of a model in reports and warnings.

use cotan::{DeformOptions, PartReport, Parts, Role};
use cotan_tool::part_names::PartNames;
use serde::Serialize;

use crate::report::number;

/// A part in the report of an edit.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct PartFields {
    /// The number in the order of the file.
    pub(crate) part: usize,
    /// The name in the file; may be empty.
    pub(crate) name: String,
    pub(crate) vertices: usize,
    pub(crate) role: &'static str,
    /// The numbers of the parts that it touches or is nearest to.
    pub(crate) follows: Vec<usize>,
    /// The change of the distance from these, over the diagonal of the bounding box.
    pub(crate) gap_change: f64,
    /// The rotation relative to these.
    pub(crate) turn_degrees: f64,
}

/// The parts of a model, in the order of the file.
pub(crate) fn fields(reports: &[PartReport], names: &PartNames) -> Vec<PartFields> {
    let named = names.parts().iter().enumerate();
    let fields = named.filter_map(|(part, named)| {
        let report = reports.get(named.component)?;
        let mut follows: Vec<usize> = report.follows.iter().map(|c| names.number_of(*c)).collect();
        follows.sort_unstable();
        Some(PartFields {
            part,
            name: named.name.clone(),
            vertices: report.vertices,
            role: role(report.role),
            follows,
            gap_change: report.gap_change,
            turn_degrees: report.turn_degrees,
        })
    });
    fields.collect()
}

/// The word for a role.
pub(crate) fn role(role: Role) -> &'static str {
    match role {
        Role::Drives => "drives",
        Role::Follows => "follows",
        _ => "still",
    }
}

/// A change of a gap, over the size, that deserves a warning.
const WIDE: f64 = 0.01;

/// A warning about the part whose gap has changed most, if that is much.
pub(crate) fn warning(parts: &[PartFields]) -> Option<String> {
    let wide: Vec<&PartFields> = parts.iter().filter(|p| p.gap_change > WIDE).collect();
    let worst = wide
        .iter()
        .max_by(|a, b| a.gap_change.total_cmp(&b.gap_change))?;
    let name = match worst.name.as_str() {
        "" => String::new(),
        name => format!(" ({name})"),
    };
    Some(format!(
        "the gap between part {}{name} and what it follows has changed by {} % of the size{}; hold \
         it with a handle, or raise --tie-strength",
        worst.part,
        number(100.0 * worst.gap_change),
        match wide.len() - 1 {
            0 => String::new(),
            others => format!(", and those of {others} more"),
        }
    ))
}

/// A warning about parts that are to follow but are tied to no other part.
pub(crate) fn stranded(
    reports: &[PartReport],
    names: &PartNames,
    options: &DeformOptions,
) -> Option<String> {
    let is_to_follow = |part: usize| match &options.parts {
        Parts::Follow => !options.ties.free.contains(&part),
        Parts::Only(parts) => parts.contains(&part) && !options.ties.free.contains(&part),
        _ => false,
    };
    let named = names.parts().iter().enumerate();
    let mut left = named.filter(|(_, named)| {
        let role = reports.get(named.component).map(|report| report.role);
        role == Some(Role::Still) && is_to_follow(named.component)
    });
    let (part, named) = left.next()?;
    let name = match named.name.as_str() {
        "" => String::new(),
        name => format!(" ({name})"),
    };
    Some(format!(
        "part {part}{name} stays where it is{}: it is tied to no part with a handle; give it a \
         handle, or untie fewer pairs",
        match left.count() {
            0 => String::new(),
            others => format!(", and {others} more"),
        }
    ))
}

/// A summary for the table, if there are several parts.
pub(crate) fn summary(parts: &[PartFields]) -> Option<String> {
    if parts.is_empty() {
        return None;
    }
    let count = |role: &str| parts.iter().filter(|part| part.role == role).count();
    let worst = parts.iter().map(|part| part.gap_change).fold(0.0, f64::max);
    let [drive, follow, still] = ["drives", "follows", "still"].map(count);
    Some(format!(
        "{drive} driving, {follow} following, {still} still; gaps change by at most {} %",
        number(100.0 * worst)
    ))
}
