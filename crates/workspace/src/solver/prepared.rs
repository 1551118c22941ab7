//! A session for the goals that share one rest shape and its settings.

use cotan::geometry::{Positions, Surface};
use cotan::halfedge::{Components, VertexId};
use cotan::smooth::Mask;
use cotan::{DeformOptions, Handles, Parts, Session};
use cotan_io::ProcessingMesh;
use cotan_tool::MemoryLimit;

use super::Goal;
use crate::handle::{HandleGroup, Role, job_handles};

/// A factorized system, and what it takes to use it.
pub(super) struct Prepared<'m> {
    pub(super) session: Session<f64>,
    mesh: &'m ProcessingMesh,
    components: Components,
    options: DeformOptions,
    /// The shares of the vertices in the motion, if only a region follows.
    region: Option<Mask>,
}

impl<'m> Prepared<'m> {
    pub(super) fn new(mesh: &'m ProcessingMesh, goal: &Goal) -> Result<Self, cotan::Error> {
        let mut options = goal.props.settings.follow.options();
        let limit = MemoryLimit::of_machine().bytes();
        options.system.max_memory.get_or_insert(limit);
        let components = mesh.mesh().components();
        let surface = Surface::assume_checked(mesh.mesh(), goal.rest.positions());
        let region = region(&surface, goal)?;
        let handles = handles(goal, mesh, &components, &options);
        let session = match &region {
            None => Session::new(surface, &handles, &options)?,
            Some(mask) => {
                let inside = mask.weights().iter().filter(|(_, w)| **w > 0.0);
                let flow = options.flow(surface).region(inside.map(|(v, _)| v));
                Session::from_flow(flow, &handles)?
            }
        };
        Ok(Self {
            session,
            mesh,
            components,
            options,
            region,
        })
    }

    /// The handles of a goal.
    pub(super) fn handles(&self, goal: &Goal) -> Handles<f64> {
        handles(goal, self.mesh, &self.components, &self.options)
    }

    /// The present shape.
    pub(super) fn shape(&self, goal: &Goal) -> Positions<f64> {
        let shape = self.session.positions();
        match &self.region {
            None => shape,
            Some(mask) => mask.blend(goal.rest.positions(), &shape),
        }
    }
}

fn handles(
    goal: &Goal,
    mesh: &ProcessingMesh,
    components: &Components,
    options: &DeformOptions,
) -> Handles<f64> {
    let loose = match options.parts {
        Parts::Still => loose_vertices(mesh, components, goal.handles()),
        _ => Vec::new(),
    };
    job_handles(goal.handles(), &loose)
}

/// The shares of the vertices around the movable handles; `None` if the whole model follows.
fn region(surface: &Surface<'_, f64>, goal: &Goal) -> Result<Option<Mask>, cotan::Error> {
    let Some(influence) = goal.props.settings.follow.influence else {
        return Ok(None);
    };
    let movable = goal.handles().iter().filter(|g| g.role == Role::Movable);
    let mut sources: Vec<VertexId> = movable.flat_map(|g| g.vertices.iter().copied()).collect();
    if sources.is_empty() {
        let all = goal.handles().iter();
        sources = all.flat_map(|g| g.vertices.iter().copied()).collect();
    }
    let side = surface.bounding_box().longest_side();
    let radius = side * influence.radius;
    let mask = Mask::around(surface, &sources, radius, radius * influence.falloff)?;
    let mesh = surface.mesh();
    match mesh.has_copies() {
        false => Ok(Some(mask)),
        // Copies of a vertex move as one.
        true => Mask::new(mesh.to_vertices(mesh.to_rows(mask.weights()))).map(Some),
    }
}

/// The vertices of the connected parts that no handle holds.
fn loose_vertices(
    mesh: &ProcessingMesh,
    components: &Components,
    handles: &[HandleGroup],
) -> Vec<VertexId> {
    let mut is_held = vec![false; components.count()];
    for &v in handles.iter().flat_map(|group| &group.vertices) {
        is_held[components.of(v)] = true;
    }
    let all = mesh.mesh().vertices();
    all.filter(|&v| !is_held[components.of(v)]).collect()
}
