//! The part of a mesh that `--mask`, `--region` and `--handles` name.

use cotan::Handles;
use cotan::halfedge::VertexId;
use cotan::smooth::Mask;
use cotan::surface::distances_within;
use cotan_tool::handles_file::{Constraint, HandlesFile, to_handles};
use nalgebra::Point3;

use crate::args::values::Length;
use crate::args::{InputPath, PartArgs, Selection};
use crate::error::CliError;
use crate::memory;
use crate::paths;
use crate::prepare::Prepared;
use crate::vertex_field::vertex_field;

/// The width of the border if none is given.
const FALLOFF: Length = Length::Share(0.05);

/// Reads the mask, if there is one.
///
/// # Errors
/// [`CliError`] for a vertex or a property that does not exist, a part without vertices, and a
/// handles file that cannot be read.
pub(crate) fn mask(args: &PartArgs, mesh: &Prepared) -> Result<Option<Mask>, CliError> {
    let surface = mesh.processing.surface();
    let longest = surface.bounding_box().longest_side();
    let falloff = args.falloff.unwrap_or(FALLOFF).on(longest);
    let mask = match &args.mask {
        Some(Selection::Property(name)) => Mask::new(vertex_field(mesh, name)?),
        Some(Selection::Near(vertex, radius)) => {
            Mask::around(&surface, &vertices_of(*vertex, mesh)?, *radius, falloff)
        }
        selection => match region(selection.as_ref(), args.mask_file.as_ref(), mesh)? {
            Some(region) => Mask::inside(&surface, &region, falloff),
            None => return Ok(None),
        },
    };
    Ok(Some(mask.map_err(|error| mesh.refuse(error))?))
}

/// The vertices of a part, which are at least one; `None` if no part is stated.
///
/// # Errors
/// As [`mask`].
pub(crate) fn region(
    selection: Option<&Selection>,
    file: Option<&InputPath>,
    mesh: &Prepared,
) -> Result<Option<Vec<VertexId>>, CliError> {
    let surface = mesh.processing.surface();
    let region = match (selection, file) {
        (None, None) => return Ok(None),
        (_, Some(file)) => vertices_in_file(file, mesh)?,
        (Some(Selection::Property(name)), _) => {
            let weights = vertex_field(mesh, name)?;
            let chosen = weights.iter().filter(|(_, weight)| **weight > 0.0);
            chosen.map(|(v, _)| v).collect()
        }
        (Some(Selection::Near(vertex, radius)), _) => {
            let near = distances_within(surface, &vertices_of(*vertex, mesh)?, *radius);
            let chosen = near.iter().filter(|(_, distance)| *distance <= radius);
            chosen.map(|(v, _)| v).collect()
        }
        (Some(Selection::Box([low, high])), _) => {
            surface.vertices_where(|p| (0..3).all(|k| low[k] <= p[k] && p[k] <= high[k]))
        }
        (Some(Selection::HalfSpace(point, normal)), _) => {
            surface.vertices_where(|p| (p - point).dot(normal) >= 0.0)
        }
        (Some(Selection::Sphere(center, radius)), _) => {
            surface.vertices_where(|p: &Point3<f64>| (p - center).norm() <= *radius)
        }
    };
    match region.is_empty() {
        true => Err(CliError::EmptyPart {
            path: mesh.path().to_owned(),
        }),
        false => Ok(Some(region)),
    }
}

/// Reads the handles of `--handles`; none without it.
///
/// # Errors
/// [`CliError`] for a file that cannot be read or does not fit the mesh.
pub(crate) fn handles(args: &PartArgs, mesh: &Prepared) -> Result<Handles<f64>, CliError> {
    let Some(path) = &args.handles else {
        return Ok(Handles::new());
    };
    let constraints = constraints(path, mesh)?;
    Ok(to_handles(&constraints, &mesh.processing, Point3::origin()))
}

/// The vertices of the surface that a handles file names.
fn vertices_in_file(path: &InputPath, mesh: &Prepared) -> Result<Vec<VertexId>, CliError> {
    let constraints = constraints(path, mesh)?;
    let vertices = constraints.iter();
    Ok(vertices
        .filter_map(|c| mesh.processing.vertex(c.vertex))
        .collect())
}

fn constraints(path: &InputPath, mesh: &Prepared) -> Result<Vec<Constraint>, CliError> {
    let file = HandlesFile {
        path,
        def: None,
        max_bytes: memory::limits().max_bytes,
    };
    if let Some(matrix) = file.default_matrix() {
        paths::check_read("the matrix of a handles file", &matrix)?;
    }
    Ok(file.read(
        &mesh.document,
        &mesh.processing,
        mesh.file_vertices.as_ref(),
    )?)
}

/// The vertices of the surface at a vertex of the file.
fn vertices_of(vertex: usize, mesh: &Prepared) -> Result<Vec<VertexId>, CliError> {
    let copies: Vec<usize> = match &mesh.file_vertices {
        Some(file) => file.in_document(vertex).collect(),
        None => vec![vertex],
    };
    let found: Vec<VertexId> = copies
        .into_iter()
        .filter_map(|copy| mesh.processing.vertex(copy))
        .collect();
    match found.is_empty() {
        true => Err(CliError::NoVertex {
            path: mesh.path().to_owned(),
            vertex,
            num_vertices: match &mesh.file_vertices {
                Some(file) => file.num_vertices(),
                None => mesh.document.positions().len(),
            },
        }),
        false => Ok(found),
    }
}
