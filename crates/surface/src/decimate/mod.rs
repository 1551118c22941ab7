//! Decimation: fewer triangles by collapsing edges, the cheapest first.
//!
//! The cost of a collapse is the sum of the squared distances of the new vertex from the planes
//! of all triangles that were merged into it, weighted by their areas.
//!
//! **Source**: M. Garland, P. Heckbert, "Surface simplification using quadric error metrics",
//! SIGGRAPH 1997. Deviations: triangles are weighted by area; a small distance from the triangles'
//! own centres makes every minimum unique and spaces vertices evenly in flat regions; costs are
//! recomputed when an edge reaches the head of the queue and not when a neighbour changes, which
//! gives the same order, since a sum of squares only grows by merging.

mod attributes;
mod collapses;
mod options;
mod quadric;
mod queue;

use cotan_geometry::{Mesh, Scalar, Surface};
use cotan_halfedge::{VertexId, VertexMap};
use nalgebra::Point3;

pub use attributes::DecimateAttributes;
pub use options::{DecimateOptions, DecimateTarget};

use crate::tessellation_error::TessellationError;
use crate::triangles::{NONE, Triangles};
use crate::units::Units;
use attributes::Channels;
use collapses::Collapses;

/// The result of [`decimate`].
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Decimated<T: Scalar> {
    /// The new mesh. Its faces and vertices are in the order of those that they come from.
    pub mesh: Mesh<T>,
    /// Per vertex of the original: the vertex that it was merged into.
    pub vertex_map: VertexMap<VertexId>,
    /// Per vertex of the new mesh: the vertex of the original whose place in the order it took.
    pub sources: VertexMap<VertexId>,
    /// The attributes at the new vertices, in the order in which they were given.
    pub attributes: Vec<VertexMap<f64>>,
    /// The largest root mean square distance of a vertex from the planes merged into it, in the
    /// unit of the positions.
    pub error: f64,
}

/// Decimates a mesh to a number of faces or an error bound.
///
/// Boundaries and the lines of [`DecimateOptions::features`] are kept: their vertices are merged
/// along the line only. A collapse that would change the topology (the link condition), turn a
/// triangle over or leave a sliver is refused, so the number of faces can stay above the target.
/// Vertices that were not merged keep their exact positions.
///
/// # Errors
/// [`TessellationError`] for options out of range.
///
/// ```
/// use cotan_surface::{DecimateOptions, decimate};
/// let sphere = cotan_geometry::icosphere::<f64>(4);
/// let small = decimate(&sphere.surface(), &DecimateOptions::to_faces(500))?;
/// assert_eq!(small.mesh.num_faces(), 500);
/// assert!((small.mesh.surface().volume() / sphere.surface().volume() - 1.0).abs() < 0.01);
/// # Ok::<(), cotan_surface::TessellationError>(())
/// ```
pub fn decimate<T: Scalar>(
    surface: &Surface<'_, T>,
    options: &DecimateOptions,
) -> Result<Decimated<T>, TessellationError> {
    let channels = Channels::new(&options.attributes, surface)?;
    let mut triangles = Triangles::new(surface)?;
    options.features.tag(surface, &mut triangles)?;
    let units = Units::of(surface);
    for p in &mut triangles.points {
        *p = units.inward(p);
    }
    let stop = options.target.stop(surface, units.scale)?;
    let mut collapses = Collapses::new(&mut triangles, &channels);
    collapses.run(&stop);
    let Collapses {
        into,
        is_moved,
        quadrics,
        error,
        ..
    } = collapses;

    let original = surface.positions().as_slice();
    let compacted = triangles.compact(|v, p| {
        if is_moved[v] {
            Point3::from(units.outward(&p).map(T::of_f64))
        } else {
            original[v]
        }
    })?;
    let values = (0..channels.num_channels()).map(|k| {
        let value = |&v: &u32| {
            let best = quadrics.channel_at(v, k, &triangles.points[v as usize]);
            let own = channels.at_vertex(v, k);
            channels.unweighted(
                k,
                if is_moved[v as usize] {
                    best.unwrap_or(own)
                } else {
                    own
                },
            )
        };
        compacted.old_vertex.iter().map(value).collect()
    });
    Ok(Decimated {
        attributes: values.collect(),
        vertex_map: resolve(into, &compacted.new_vertex),
        sources: compacted
            .old_vertex
            .iter()
            .map(|&v| VertexId::new(v as usize))
            .collect(),
        mesh: compacted.mesh,
        error: error / units.scale,
    })
}

/// Follows each vertex to the one that it was merged into.
fn resolve(mut into: Vec<u32>, new_vertex: &[u32]) -> VertexMap<VertexId> {
    for v in 0..into.len() {
        let mut end = v as u32;
        while into[end as usize] != NONE {
            end = into[end as usize];
        }
        // Shortens the path for those that follow.
        let mut at = v as u32;
        while into[at as usize] != NONE {
            at = std::mem::replace(&mut into[at as usize], end);
        }
    }
    let end = |v: usize| if into[v] == NONE { v as u32 } else { into[v] };
    (0..into.len())
        .map(|v| VertexId::new(new_vertex[end(v) as usize] as usize))
        .collect()
}
