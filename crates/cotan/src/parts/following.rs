//! The parts that follow a flow.

use std::sync::Arc;

use cotan_flow::{Flow, FlowBuilder, PointTie};
use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::{HalfedgeMesh, VertexId};
use cotan_linear::Handle;
use cotan_parallel as parallel;
use nalgebra::{Point3, Vector3};

use super::contacts::{Contact, ContactPoint};
use super::extract::Extract;
use super::passenger::{Effort, Passenger, Placed, Rigid, Scene, State, put};
use super::plan::{Neighbourhood, Plan};
use super::report::{self, PartReport};
use super::workshop::Workshop;
use crate::error::Error;
use crate::options::DeformOptions;

/// A model of which some parts are solved and others follow.
#[derive(Debug)]
pub(crate) struct Following<T: Scalar> {
    neighbourhood: Arc<Neighbourhood>,
    plan: Plan,
    options: DeformOptions,
    mesh: Arc<HalfedgeMesh>,
    original: Arc<Positions<T>>,
    /// The parts that drive; `None` if all do.
    drivers: Option<Extract<T>>,
    passengers: Vec<Passenger<T>>,
    /// The latest positions of the parts that do not drive. Those of the drivers are from the same
    /// time.
    placed: Positions<T>,
    motions: Vec<Option<Rigid>>,
}

/// Handles with their targets.
type Held<T> = [(Handle, Point3<T>)];

impl<T: Scalar> Following<T> {
    /// Plans a deformation; `None` if no part follows, or none drives.
    ///
    /// # Errors
    /// [`Error`] for parts that do not exist and settings out of range.
    pub(crate) fn new(
        surface: &Surface<'_, T>,
        options: &DeformOptions,
        held: &Held<T>,
    ) -> Result<Option<Self>, Error> {
        if held.is_empty() {
            return Ok(None);
        }
        let Some(neighbourhood) = Neighbourhood::new(surface, options)? else {
            return Ok(None);
        };
        let mesh = Arc::new(surface.mesh().clone());
        let original = Arc::new(mesh.to_rows(surface.positions()));
        let neighbourhood = Arc::new(neighbourhood);
        Ok(Some(Self::plan(
            neighbourhood,
            mesh,
            original,
            options,
            held,
        )))
    }

    /// The same model for other handles.
    pub(crate) fn with_handles(&self, held: &Held<T>) -> Self {
        let (mesh, original) = (self.mesh.clone(), self.original.clone());
        Self::plan(
            self.neighbourhood.clone(),
            mesh,
            original,
            &self.options,
            held,
        )
    }

    /// Returns true if the same parts drive with these handles.
    pub(crate) fn is_for(&self, held: &Held<T>) -> bool {
        self.plan.is_for(&has_handle(&self.neighbourhood, held))
    }

    fn plan(
        neighbourhood: Arc<Neighbourhood>,
        mesh: Arc<HalfedgeMesh>,
        original: Arc<Positions<T>>,
        options: &DeformOptions,
        held: &Held<T>,
    ) -> Self {
        let mut plan = neighbourhood.plan(has_handle(&neighbourhood, held));
        let model = &neighbourhood.model;
        let drives = |v: VertexId| plan.roles.layers[model.part_of(v)] == 0;
        let drivers = (!plan.drives_all()).then(|| Extract::new(&mesh, &original, drives));
        let seats = std::mem::take(&mut plan.seats);
        let passengers = parallel::tasks(seats, |seat| Passenger::new(model, seat));
        Self {
            placed: (*original).clone(),
            motions: vec![None; model.parts.len()],
            options: options.clone(),
            neighbourhood,
            plan,
            mesh,
            original,
            drivers,
            passengers,
        }
    }

    /// The flow of the parts that drive, without its handles.
    pub(crate) fn flow(&self) -> FlowBuilder<T> {
        let (mesh, positions) = match &self.drivers {
            Some(extract) => (extract.mesh.clone(), extract.positions.clone()),
            None => (self.mesh.clone(), self.original.clone()),
        };
        let point = |point: &ContactPoint| {
            let corner = |k: usize| {
                let vertex = VertexId::new(point.corners[k] as usize);
                (self.in_flow(vertex), point.shares[k])
            };
            [0, 1, 2].map(corner)
        };
        let tie = |contact: &Contact| PointTie {
            own: point(&contact.own),
            on: point(&contact.on),
            weight: contact.weight,
            nearness: contact.nearness,
        };
        let ties: Vec<PointTie> = self.plan.ties.iter().map(tie).collect();
        self.options
            .apply(Flow::builder(mesh, positions))
            .ties(ties)
    }

    /// The original positions of all parts.
    pub(crate) fn original(&self) -> &Positions<T> {
        &self.original
    }

    /// The index of a vertex among those of the drivers. Every handle is on a driver.
    pub(crate) fn in_flow(&self, vertex: VertexId) -> VertexId {
        match &self.drivers {
            Some(extract) => extract.in_extract(vertex.index() as u32).unwrap_or(vertex),
            None => vertex,
        }
    }

    /// The vertices of the flow, as indices of the whole mesh.
    pub(crate) fn flow_vertices(&self) -> Vec<VertexId> {
        match &self.drivers {
            Some(extract) => {
                let vertices = extract.vertices().iter();
                vertices.map(|v| VertexId::new(*v as usize)).collect()
            }
            None => self.mesh.rows().collect(),
        }
    }

    /// The handles, with the vertex indices of the flow.
    pub(crate) fn handles_in_flow(&self, held: &Held<T>) -> Vec<(Handle, Point3<T>)> {
        let handle = |(handle, target): &(Handle, Point3<T>)| {
            let vertex = self.in_flow(handle.vertex);
            (Handle { vertex, ..*handle }, *target)
        };
        held.iter().map(handle).collect()
    }

    /// An error of the flow, with the vertex indices of the whole mesh.
    pub(crate) fn in_whole(&self, error: Error) -> Error {
        match &self.drivers {
            Some(extract) => error.with_vertices(|v| match v.index() < extract.vertices().len() {
                true => VertexId::new(extract.in_whole(v) as usize),
                false => v,
            }),
            None => error,
        }
    }

    /// The drivers' part of a shape of all parts.
    pub(crate) fn in_flow_shape(&self, shape: &Positions<T>) -> Option<Positions<T>> {
        let shape = self.in_rows(shape)?;
        Some(match &self.drivers {
            Some(extract) => {
                let vertices = extract.vertices().iter();
                vertices.map(|v| shape.as_slice()[*v as usize]).collect()
            }
            None => shape,
        })
    }

    /// Converts a shape with one position per vertex or per row to one per row.
    fn in_rows(&self, shape: &Positions<T>) -> Option<Positions<T>> {
        let is_known = [self.mesh.num_vertices(), self.mesh.num_rows()].contains(&shape.len());
        is_known.then(|| self.mesh.to_rows(shape))
    }

    /// The whole mesh.
    pub(crate) fn mesh(&self) -> &HalfedgeMesh {
        &self.mesh
    }

    /// Sets the shape of the parts that do not drive.
    pub(crate) fn set_shape(&mut self, shape: &Positions<T>) {
        if let Some(rows) = self.in_rows(shape) {
            self.placed = rows;
            self.unsettle();
        }
    }

    /// All parts, with the drivers at these positions.
    pub(crate) fn whole(&self, drivers: &Positions<T>) -> Positions<T> {
        let Some(extract) = &self.drivers else {
            return drivers.clone();
        };
        let mut whole = self.placed.clone();
        for (v, p) in extract.vertices().iter().zip(drivers.values()) {
            whole.as_mut_slice()[*v as usize] = *p;
        }
        whole
    }

    /// Places the parts that follow, layer by layer.
    ///
    /// # Errors
    /// [`Error`] of the flow of a large part.
    pub(crate) fn place(&mut self, drivers: &Positions<T>, effort: Effort) -> Result<(), Error> {
        let placed = self.place_layers(drivers, effort);
        if placed.is_err() {
            self.unsettle();
        }
        placed
    }

    /// From here on no part that follows is where it belongs.
    fn unsettle(&mut self) {
        let passengers = self.passengers.iter_mut();
        passengers.for_each(|passenger| passenger.state = State::Underway);
    }

    fn place_layers(&mut self, drivers: &Positions<T>, effort: Effort) -> Result<(), Error> {
        let Some(extract) = self
            .drivers
            .as_ref()
            .filter(|_| !self.passengers.is_empty())
        else {
            return Ok(());
        };
        let placed = self.placed.as_mut_slice();
        let mut has_moved = vec![false; placed.len()];
        for (v, p) in extract.vertices().iter().zip(drivers.values()) {
            let v = *v as usize;
            has_moved[v] = placed[v] != *p;
            placed[v] = *p;
        }
        let model = &self.neighbourhood.model;
        let workshop = Workshop {
            neighbourhood: &self.neighbourhood,
            mesh: &self.mesh,
            original: &self.original,
            options: &self.options,
        };
        let mut now = parallel::filled(placed.len(), |v| placed[v].map(T::as_f64));
        for layer in self.passengers.chunk_by_mut(|a, b| a.layer == b.layer) {
            let scene = Scene {
                model,
                length: self.neighbourhood.length,
                now: &now,
                has_moved: &has_moved,
                motions: &self.motions,
            };
            let found = parallel::tasks(layer.iter_mut().collect(), |passenger| {
                let placed = passenger.place(&scene, &workshop, effort)?;
                Ok::<_, Error>(placed.map(|placed| (passenger.part, placed)))
            });
            for placed in found {
                let Some((part, Placed { positions, motion })) = placed? else {
                    continue;
                };
                put(model, part, &self.original, &positions, &mut self.placed);
                for (v, p) in model.parts[part].vertices.iter().zip(positions) {
                    let v = *v as usize;
                    has_moved[v] = now[v] != p;
                    now[v] = p;
                }
                self.motions[part] = motion;
            }
        }
        Ok(())
    }

    /// The roles of all parts and how well they follow.
    pub(crate) fn report(&self, drivers: &Positions<T>) -> Vec<PartReport> {
        let whole = self.whole(drivers);
        let now: Vec<Point3<f64>> = whole.values().map(|p| p.map(T::as_f64)).collect();
        let scene = Scene {
            model: &self.neighbourhood.model,
            length: self.neighbourhood.length,
            now: &now,
            has_moved: &[],
            motions: &self.motions,
        };
        report::measure(&scene, &self.plan, &self.passengers)
    }
}

/// Per part: whether it has handles.
fn has_handle<T: Scalar>(neighbourhood: &Neighbourhood, held: &Held<T>) -> Vec<bool> {
    let model = &neighbourhood.model;
    let mut has_handle = vec![false; model.parts.len()];
    for (handle, _) in held {
        has_handle[model.part_of(handle.vertex)] = true;
    }
    has_handle
}

/// Stated turns, with the vertex indices of the flow.
pub(crate) fn turns_in_flow<T: Scalar>(
    following: &Following<T>,
    stated: Vec<(VertexId, Vector3<f64>)>,
) -> Vec<(VertexId, Vector3<f64>)> {
    let in_flow = |(v, turn)| (following.in_flow(v), turn);
    stated.into_iter().map(in_flow).collect()
}
