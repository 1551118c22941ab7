//! The parts that would follow others, found without solving anything.

use cotan_geometry::{Scalar, Surface};

use super::plan::Neighbourhood;
use super::report::PartReport;
use crate::error::Error;
use crate::options::DeformOptions;

/// The parts of a surface, and the parts that each would follow if only the part with the largest
/// area had handles. Empty for a surface of a single part. Gaps and turns are 0.
///
/// # Errors
/// [`Error`] for options that name parts which do not exist.
pub fn survey<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    options: &DeformOptions,
) -> Result<Vec<PartReport>, Error> {
    let Some(neighbourhood) = Neighbourhood::new(&surface.into(), options)? else {
        return Ok(Vec::new());
    };
    let parts = &neighbourhood.model.parts;
    let largest = (0..parts.len()).max_by(|a, b| {
        let by_area = parts[*a].area.total_cmp(&parts[*b].area);
        by_area.then(b.cmp(a))
    });
    let has_handle = (0..parts.len()).map(|p| Some(p) == largest).collect();
    let plan = neighbourhood.plan(has_handle);
    let roles = parts.iter().zip(&plan.roles.roles);
    let mut reports: Vec<PartReport> = roles
        .map(|(part, role)| PartReport::new(part.vertices.len(), *role))
        .collect();
    for seat in &plan.seats {
        let followed = seat.contacts.iter().map(|contact| contact.part);
        reports[seat.part].set_followed(followed);
    }
    Ok(reports)
}
