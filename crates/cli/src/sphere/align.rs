//! The rotation of one sphere map to another.

use cotan::geometry::Positions;
use cotan::sphere::SphereMap;

use super::landmarks::pairs;
use super::mapping::Mapped;
use super::refusal::refuse;
use crate::args::InputPath;
use crate::error::CliError;
use crate::prepare::Prepared;

/// The property that corresponding places have in common.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Common<'a> {
    /// They are near each other in space, relative to the bounding boxes.
    Pose,
    /// Both maps shrink areas alike there.
    Areas,
    /// They are named in a file: pairs of a vertex of the first mesh and one of the second.
    Landmarks(&'a InputPath),
}

/// The sphere of the second mesh, rotated to fit that of the first.
///
/// # Errors
/// [`CliError`] for landmarks that cannot be read or do not determine a rotation.
pub(crate) fn aligned(
    meshes: [&Prepared; 2],
    [a, b]: [&Mapped<f64>; 2],
    common: Common<'_>,
) -> Result<SphereMap<f64>, CliError> {
    let refuse = |error| refuse(meshes[1], error);
    let aligned = match common {
        Common::Landmarks(path) => {
            let pairs = pairs(path, meshes)?;
            let pairs: Vec<_> = pairs.into_iter().map(|[a, b]| (b, a)).collect();
            b.map.align_landmarks(&a.map, &pairs)
        }
        Common::Pose => b.map.align(&in_box(b), &a.map, &in_box(a)),
        Common::Areas => {
            let [of_a, of_b] = [a, b].map(|m| m.map.area_density(&m.positions));
            b.map
                .align(&of_b.map_err(refuse)?, &a.map, &of_a.map_err(refuse)?)
        }
    };
    Ok(aligned.map_err(refuse)?.map)
}

/// The positions relative to the bounding box, so that shapes of different size and place
/// compare.
fn in_box(mapped: &Mapped<f64>) -> Positions<f64> {
    let bounds = mapped.surface().bounding_box();
    let (center, size) = (bounds.center(), bounds.diagonal());
    mapped.positions.map(|p| ((p - center) / size).into())
}
