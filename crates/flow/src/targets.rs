//! The handles and their targets.

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_linear::{Handle, Hold, PreparedSystem};
use nalgebra::{Point3, Vector3};

use crate::box_units::BoxUnits;
use crate::error::FlowError;

/// The handles of a flow, each with its target.
#[derive(Debug)]
pub(crate) struct Targets<T: Scalar> {
    units: BoxUnits<T>,
    handles: Vec<Handle>,
    /// In the units of the input and in box units.
    in_input: Vec<Point3<T>>,
    in_box: Vec<Point3<T>>,
    /// The index of the handle of each vertex.
    index_of: VertexMap<Option<u32>>,
    /// For each vertex, `true` if it may move; `None` if all may.
    region: Option<VertexMap<bool>>,
}

/// The result of a change of the targets: some are different, or all are as before.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[must_use]
pub(crate) enum Changed {
    Yes,
    No,
}

impl<T: Scalar> Targets<T> {
    /// Checks the targets; the system checks the handles.
    pub(crate) fn new(
        units: BoxUnits<T>,
        mesh: &HalfedgeMesh,
        handles: &[(Handle, Point3<T>)],
        region: Option<&[VertexId]>,
    ) -> Result<Self, FlowError> {
        check(&units, handles)?;
        let region = region
            .map(|vertices| is_within(mesh, vertices))
            .transpose()?;
        let (handles, in_input): (Vec<Handle>, Vec<Point3<T>>) = handles.iter().copied().unzip();
        Ok(Self {
            units,
            in_box: in_input.iter().map(|p| units.to_box(*p)).collect(),
            in_input,
            index_of: index_of(&handles, mesh.num_rows()),
            handles,
            region,
        })
    }

    pub(crate) fn handles(&self) -> &[Handle] {
        &self.handles
    }

    /// The targets in the units of the input.
    pub(crate) fn in_input(&self) -> &[Point3<T>] {
        &self.in_input
    }

    /// The targets in box units.
    pub(crate) fn in_box(&self) -> &[Point3<T>] {
        &self.in_box
    }

    /// The handles, and hard ones at all other vertices outside of the region, as the system needs
    /// them.
    pub(crate) fn held(&self) -> Vec<Handle> {
        with_outside(&self.handles, self.region.as_ref())
    }

    /// Moves all handles, in their order.
    pub(crate) fn move_all(&mut self, targets: &[Point3<T>]) -> Result<Changed, FlowError> {
        if targets.len() != self.handles.len() {
            return Err(FlowError::TargetCount {
                targets: targets.len(),
                handles: self.handles.len(),
            });
        }
        for (handle, target) in self.handles.iter().zip(targets) {
            check_one(&self.units, handle.vertex, target)?;
        }
        Ok(self.put(targets.to_vec()))
    }

    /// Moves some handles.
    pub(crate) fn move_some(
        &mut self,
        moves: &[(VertexId, Point3<T>)],
    ) -> Result<Changed, FlowError> {
        let mut targets = self.in_input.clone();
        for (vertex, target) in moves {
            check_one(&self.units, *vertex, target)?;
            let index = self
                .index_of
                .get(*vertex)
                .copied()
                .flatten()
                .ok_or(FlowError::NotAHandle { vertex: *vertex })?;
            targets[index as usize] = *target;
        }
        Ok(self.put(targets))
    }

    /// Exchanges the handles, in the system too.
    pub(crate) fn replace(
        &mut self,
        handles: &[(Handle, Point3<T>)],
        system: &mut PreparedSystem,
    ) -> Result<Changed, FlowError> {
        check(&self.units, handles)?;
        let (handles, targets): (Vec<Handle>, Vec<Point3<T>>) = handles.iter().copied().unzip();
        if self.handles == handles {
            return Ok(self.put(targets));
        }
        system.set_handles(&with_outside(&handles, self.region.as_ref()))?;
        self.index_of = index_of(&handles, self.index_of.len());
        self.handles = handles;
        let _ = self.put(targets);
        Ok(Changed::Yes)
    }

    fn put(&mut self, in_input: Vec<Point3<T>>) -> Changed {
        if self.in_input == in_input {
            return Changed::No;
        }
        self.in_box = in_input.iter().map(|p| self.units.to_box(*p)).collect();
        self.in_input = in_input;
        Changed::Yes
    }

    /// Puts the hard handles on their targets, in box units, except those that are kept.
    pub(crate) fn pin(&self, positions: &mut Positions<T>, is_kept: impl Fn(VertexId) -> bool) {
        for (handle, target) in self.handles.iter().zip(&self.in_box) {
            if handle.hold == Hold::Hard && !is_kept(handle.vertex) {
                positions[handle.vertex] = *target;
            }
        }
    }

    /// Puts the hard handles on their targets, in the units of the input.
    pub(crate) fn pin_in_input(&self, positions: &mut Positions<T>) {
        for (handle, target) in self.handles.iter().zip(&self.in_input) {
            if handle.hold == Hold::Hard {
                positions[handle.vertex] = *target;
            }
        }
    }

    /// Writes u − x at the soft handles.
    pub(crate) fn pull(&self, positions: &Positions<T>, pull: &mut VertexMap<Vector3<f64>>) {
        for (handle, target) in self.handles.iter().zip(&self.in_box) {
            if handle.hold != Hold::Hard {
                pull[handle.vertex] = (target - positions[handle.vertex]).map(T::as_f64);
            }
        }
    }

    /// Σ k² |x − u|² over the soft handles.
    pub(crate) fn spring_energy(&self, positions: &Positions<T>, system: &PreparedSystem) -> f64 {
        let of_handle = |(handle, target): (&Handle, &Point3<T>)| match handle.hold {
            Hold::Hard => 0.0,
            Hold::Soft(_) => {
                let miss = (target - positions[handle.vertex]).norm_squared();
                system.spring(handle.vertex) * miss.as_f64()
            }
        };
        self.handles.iter().zip(&self.in_box).map(of_handle).sum()
    }
}

/// Per vertex the index of its handle. A handle that does not exist is refused by the system.
fn index_of(handles: &[Handle], num_vertices: usize) -> VertexMap<Option<u32>> {
    let mut index_of = VertexMap::filled(num_vertices, None);
    for (index, handle) in handles.iter().enumerate() {
        if let Some(slot) = index_of.as_mut_slice().get_mut(handle.vertex.index()) {
            *slot = Some(index as u32);
        }
    }
    index_of
}

fn check<T: Scalar>(units: &BoxUnits<T>, handles: &[(Handle, Point3<T>)]) -> Result<(), FlowError> {
    handles
        .iter()
        .try_for_each(|(handle, target)| check_one(units, handle.vertex, target))
}

/// Refuses targets that are not finite, or so far away that the mesh would lose its digits.
fn check_one<T: Scalar>(
    units: &BoxUnits<T>,
    vertex: VertexId,
    target: &Point3<T>,
) -> Result<(), FlowError> {
    // In box units: so far away that the precision keeps four digits of the mesh.
    let farthest = (1e-4 / T::default_epsilon().as_f64()).min(1e9);
    if target.iter().any(|x| !x.is_finite()) {
        return Err(FlowError::NonFiniteTarget { vertex });
    }
    let boxed = units.to_box(*target);
    if boxed.iter().any(|x| !(x.as_f64().abs() <= farthest)) {
        return Err(FlowError::TargetTooFar { vertex });
    }
    Ok(())
}

/// Marks these vertices.
fn is_within(mesh: &HalfedgeMesh, vertices: &[VertexId]) -> Result<VertexMap<bool>, FlowError> {
    let num_vertices = mesh.num_vertices();
    let mut is_inside = VertexMap::filled(mesh.num_rows(), false);
    for &vertex in vertices {
        if vertex.index() >= num_vertices {
            return Err(FlowError::RegionOutOfRange {
                vertex,
                num_vertices,
            });
        }
        is_inside[mesh.row_of(vertex)] = true;
    }
    Ok(is_inside)
}

fn with_outside(handles: &[Handle], region: Option<&VertexMap<bool>>) -> Vec<Handle> {
    let mut held = handles.to_vec();
    if let Some(region) = region {
        let mut is_free = region.clone();
        for handle in handles {
            // One that does not exist is refused by the system.
            if let Some(free) = is_free.as_mut_slice().get_mut(handle.vertex.index()) {
                *free = true;
            }
        }
        let outside = is_free.iter().filter(|(_, free)| !**free);
        held.extend(outside.map(|(vertex, _)| Handle::hard(vertex)));
    }
    held
}
