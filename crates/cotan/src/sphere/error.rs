//! Errors of sphere maps.

use cotan_flow::FlowError;
use cotan_geometry::{Readable, SurfaceError};
use cotan_halfedge::{FaceId, HalfedgeMesh, VertexId};
use cotan_laplacian::SchemeError;
use cotan_linear::LinearError;
use thiserror::Error;

/// The reason why a mesh cannot be mapped to the sphere, or why a map is invalid.
#[derive(Clone, PartialEq, Debug, Error)]
#[non_exhaustive]
pub enum SphereError {
    /// The mesh has holes.
    #[error(
        "the mesh is not closed: it has {loops} hole(s), among them the one at vertex {vertex}; fill them (--fill-holes), since only a closed mesh covers the sphere"
    )]
    NotClosed {
        /// Number of boundary loops.
        loops: usize,
        /// The lowest vertex at a hole.
        vertex: VertexId,
    },
    /// The mesh has handles, like a torus.
    #[error(
        "the mesh has genus {genus}, and only genus 0 (no tunnel through it) can be mapped to the sphere; cut its tunnels and fill the cuts first"
    )]
    Genus {
        /// The genus.
        genus: usize,
    },
    /// The mesh has several components.
    #[error(
        "the mesh has {} components ({}); a sphere map is of one: keep one of them (cotan repair --keep-largest)", components.len(), list_components(components)
    )]
    Components {
        /// The lowest vertex and the number of vertices of each component.
        components: Vec<(VertexId, usize)>,
    },
    /// The mesh was cut into pieces that share vertices.
    #[error(
        "several sheets of the mesh meet at vertex {vertex} (a non-manifold edge or a bow-tie), and only one manifold surface can be mapped to the sphere; separate them with cotan repair --split-edges"
    )]
    Pieces {
        /// A vertex that they share.
        vertex: VertexId,
    },
    /// The mesh has fewer than four faces.
    #[error("the mesh has {faces} faces, and a closed surface needs at least four")]
    TooFewFaces {
        /// The number of faces.
        faces: usize,
    },
    /// The mesh and its positions do not form a surface.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// No weights can be computed for the surface.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// The flow could not be built or could not continue.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// A vertex is not on the unit sphere.
    #[error("vertex {vertex} lies {distance:.1e} off the unit sphere")]
    OffSphere {
        /// The vertex.
        vertex: VertexId,
        /// | |v| − 1 |.
        distance: f64,
    },
    /// The image of a vertex is not finite.
    #[error(
        "vertex {vertex} has no finite place on the sphere, as a step overflowed: lengths in this mesh differ by too many orders of magnitude; --method robust maps it"
    )]
    Overflow {
        /// The vertex.
        vertex: VertexId,
    },
    /// Some triangles are flipped, and no stage could repair them.
    #[error(
        "{count} triangle(s) are flipped or degenerate on the sphere, the first is face {first}; --method robust mends that"
    )]
    Flipped {
        /// The number of these triangles.
        count: usize,
        /// The lowest of them.
        first: FaceId,
    },
    /// The map covers the sphere several times.
    #[error("the triangles cover the sphere {degree} times instead of once")]
    Degree {
        /// The number of times.
        degree: i64,
    },
    /// A setting is out of range.
    #[error("the {setting} must be {range}, but is {}", Readable(*value))]
    Setting {
        /// The name of the setting.
        setting: &'static str,
        /// The allowed range.
        range: &'static str,
        /// The given value.
        value: f64,
    },
    /// Landmarks, or vertices of another mesh, do not match.
    #[error("{0}")]
    Mismatch(String),
}

impl SphereError {
    /// Returns true if the error says that positions are not a one-to-one map onto the sphere, in
    /// which case other positions may succeed.
    pub(crate) fn is_no_map(&self) -> bool {
        matches!(
            self,
            Self::OffSphere { .. }
                | Self::Overflow { .. }
                | Self::Flipped { .. }
                | Self::Degree { .. }
        )
    }
}

impl From<LinearError> for SphereError {
    fn from(error: LinearError) -> Self {
        Self::Flow(error.into())
    }
}

fn list_components(components: &[(VertexId, usize)]) -> String {
    const MOST: usize = 5;
    let mut text: Vec<String> = components
        .iter()
        .take(MOST)
        .map(|(v, n)| format!("{n} vertices from vertex {v}"))
        .collect();
    if components.len() > MOST {
        text.push(format!("{} more", components.len() - MOST));
    }
    text.join(", ")
}

/// Rejects everything but a closed, connected triangle mesh of genus 0.
pub(crate) fn check_topology(mesh: &HalfedgeMesh) -> Result<(), SphereError> {
    if let Some((_, vertex)) = mesh.copies().next() {
        return Err(SphereError::Pieces { vertex });
    }
    let components = mesh.components();
    if components.count() > 1 {
        let mut first = vec![None; components.count()];
        for v in mesh.vertices() {
            first[components.of(v)].get_or_insert(v);
        }
        let found = first.into_iter().flatten();
        return Err(SphereError::Components {
            components: found.zip(components.sizes().iter().copied()).collect(),
        });
    }
    if let Some(face) = mesh.faces().find(|&f| mesh.degree(f) != 3) {
        return Err(SurfaceError::NotTriangles {
            face: face.index(),
            degree: mesh.degree(face),
        }
        .into());
    }
    if let Some(vertex) = mesh.vertices().find(|&v| mesh.is_boundary_vertex(v)) {
        return Err(SphereError::NotClosed {
            loops: mesh.boundary_loops().len(),
            vertex,
        });
    }
    if mesh.num_faces() < 4 {
        return Err(SphereError::TooFewFaces {
            faces: mesh.num_faces(),
        });
    }
    // For one closed component, χ = 2 − 2 genus.
    match (2 - mesh.euler_characteristic()) / 2 {
        0 => Ok(()),
        genus => Err(SphereError::Genus {
            genus: genus.unsigned_abs() as usize,
        }),
    }
}
