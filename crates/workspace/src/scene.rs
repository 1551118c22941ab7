//! One state of everything that a command can change.

use std::collections::BTreeMap;
use std::sync::Arc;

use cotan::halfedge::{HalfedgeMesh, VertexId};
use serde::{Deserialize, Serialize};

use crate::handle::{HandleGroup, Origin};
use crate::mask::{NamedMask, Restriction};
use crate::mirror::Mirror;
use crate::plain;
use crate::settings::Settings;
use crate::shape::Shape;

/// One state of everything that a command can change.
///
/// A scene is immutable: a command makes a new one that shares the unchanged parts with the old
/// one. Undo is therefore a list of scenes, and the solver can hold one while the next is being
/// made.
#[derive(Clone, PartialEq, Debug)]
pub struct Scene {
    /// The rest shape of the deformation: as read from the file, or as left by a job.
    pub rest: Shape,
    /// The shape that is shown and saved.
    pub shape: Shape,
    /// `true` if the shape has converged to its handles, within the tolerance.
    pub is_settled: bool,
    /// The handles, selection, masks and settings.
    pub props: Arc<Props>,
}

/// The parts of a scene other than its shapes.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Props {
    /// The handles that hold the mesh.
    pub handles: Vec<HandleGroup>,
    /// The handle that the gizmo and the delete key act on.
    pub active: Option<usize>,
    /// Further handles that move with it, in ascending order.
    pub also_active: Vec<usize>,
    /// The vertex about which handles turn and scale; `None` for the middle of the active ones.
    #[serde(with = "plain::id")]
    pub pivot: Option<VertexId>,
    /// The plane across which selections, handles and brushes are mirrored.
    pub mirror: Option<Mirror>,
    /// The selected vertices, sorted and without duplicates.
    #[serde(with = "plain::ids")]
    pub selection: Vec<VertexId>,
    /// The vertices that are not shown and cannot be selected, sorted and without duplicates.
    #[serde(with = "plain::ids")]
    pub hidden: Vec<VertexId>,
    /// The masks.
    pub masks: Vec<NamedMask>,
    /// The mask that restricts jobs.
    pub mask: Option<usize>,
    /// The settings.
    pub settings: Settings,
}

impl Scene {
    /// Makes the scene of a model that was just opened.
    pub fn new(shape: Shape) -> Self {
        Self {
            rest: shape.clone(),
            shape,
            is_settled: true,
            props: Arc::default(),
        }
    }

    /// The handles.
    pub fn handles(&self) -> &[HandleGroup] {
        &self.props.handles
    }

    /// The selected vertices.
    pub fn selection(&self) -> &[VertexId] {
        &self.props.selection
    }

    /// The vertices that are not shown and cannot be selected.
    pub fn hidden(&self) -> &[VertexId] {
        &self.props.hidden
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.props.settings
    }

    /// The active handle, if there is one.
    pub fn active(&self) -> Option<&HandleGroup> {
        self.handles().get(self.props.active?)
    }

    /// The index of the group that fixes the open boundary, if there is one.
    pub fn boundary_handle(&self) -> Option<usize> {
        self.handles()
            .iter()
            .position(|group| group.name == BOUNDARY)
    }

    /// A copy with other properties.
    #[must_use]
    pub(crate) fn with(&self, edit: impl FnOnce(&mut Props)) -> Self {
        let mut scene = self.clone();
        edit(Arc::make_mut(&mut scene.props));
        scene
    }

    /// The scene on a new rest shape, on which the handles hold their vertices where they are.
    #[must_use]
    pub(crate) fn on(&self, shape: &Shape) -> Self {
        let mut scene = self.with(|props| {
            for group in &mut props.handles {
                *group = group.on(shape);
            }
        });
        scene.rest = shape.clone();
        scene.shape = shape.clone();
        scene.is_settled = true;
        scene
    }

    /// The restriction of a job that starts from this scene, on a model whose longest side is
    /// `side`.
    pub(crate) fn restriction(&self, side: f64) -> Restriction<'_> {
        Restriction {
            mask: self.props.mask.and_then(|k| self.props.masks.get(k)),
            selection: self.selection(),
            handles: self.handles(),
            border: side * self.settings().border,
        }
    }
}

impl Props {
    /// The active handles, the first one first.
    pub fn active_handles(&self) -> impl Iterator<Item = usize> + '_ {
        self.active
            .into_iter()
            .chain(self.also_active.iter().copied())
    }

    /// Returns true if a handle is one of the active ones.
    pub fn is_active(&self, handle: usize) -> bool {
        self.active_handles().any(|active| active == handle)
    }

    /// Makes a handle the only active one, or none.
    pub(crate) fn activate(&mut self, handle: Option<usize>) {
        self.active = handle;
        self.also_active.clear();
    }

    /// Adds a handle to the active ones, or takes it away if it is one.
    pub(crate) fn activate_too(&mut self, handle: usize) {
        let mut all: Vec<usize> = self.active_handles().collect();
        match all.iter().position(|k| *k == handle) {
            Some(at) => drop(all.remove(at)),
            None => all.push(handle),
        }
        self.active = all.first().copied();
        self.also_active = all.into_iter().skip(1).collect();
        self.also_active.sort_unstable();
    }

    /// The properties with other ids of the vertices. Those without one are left out.
    #[must_use]
    pub(crate) fn renumbered(&self, id: &dyn Fn(VertexId) -> Option<VertexId>) -> Self {
        let mut props = self.clone();
        for group in &mut props.handles {
            match &mut group.origin {
                Origin::Rest => group.vertices = sorted(&group.vertices, id),
                Origin::Places(places) => {
                    (group.vertices, *places) = sorted_with(&group.vertices, places, id);
                }
            }
        }
        for mask in &mut props.masks {
            (mask.vertices, mask.weights) = sorted_with(&mask.vertices, &mask.weights, id);
        }
        props.selection = sorted(&props.selection, id);
        props.hidden = sorted(&props.hidden, id);
        props.pivot = props.pivot.and_then(id);
        props
    }

    /// The properties with all copies of the vertices that they name: copies move as one.
    #[must_use]
    pub(crate) fn with_copies(mut self, mesh: &HalfedgeMesh) -> Self {
        if !mesh.has_copies() {
            return self;
        }
        for group in &mut self.handles {
            match &mut group.origin {
                Origin::Rest => group.vertices = all_copies(mesh, &group.vertices),
                Origin::Places(places) => {
                    (group.vertices, *places) = all_copies_with(mesh, &group.vertices, places);
                }
            }
        }
        for mask in &mut self.masks {
            (mask.vertices, mask.weights) = all_copies_with(mesh, &mask.vertices, &mask.weights);
        }
        self.selection = all_copies(mesh, &self.selection);
        self.hidden = all_copies(mesh, &self.hidden);
        self
    }

    /// The problem of properties that come from a file, if they are not those of a model of so
    /// many vertices.
    pub(crate) fn problem(&self, num_vertices: usize) -> Option<String> {
        let handle = self.handles.iter().find(|g| !g.fits(num_vertices));
        let mask = self.masks.iter().find(|m| !m.fits(num_vertices));
        let fits = |vertices: &[VertexId]| {
            let is_inside = vertices.last().is_none_or(|v| v.index() < num_vertices);
            is_inside && vertices.is_sorted_by(|a, b| a < b)
        };
        if let Some(group) = handle {
            return Some(format!(
                "its handle \"{}\" does not fit the mesh",
                group.name
            ));
        }
        if let Some(mask) = mask {
            return Some(format!("its mask \"{}\" does not fit the mesh", mask.name));
        }
        if !fits(&self.selection) || !fits(&self.hidden) {
            return Some("its selection does not fit the mesh".to_owned());
        }
        let is_known = |vertex: VertexId| vertex.index() < num_vertices;
        if !self.pivot.is_none_or(is_known) || !self.mirror.is_none_or(|m| m.is_valid()) {
            return Some("its pivot or its mirror does not fit the mesh".to_owned());
        }
        let also = &self.also_active;
        let is_sound = also.is_sorted_by(|a, b| a < b)
            && also.last().is_none_or(|k| *k < self.handles.len())
            && self.active.is_none_or(|k| !also.contains(&k))
            && (self.active.is_some() || also.is_empty());
        if !is_sound || self.active.is_some_and(|k| k >= self.handles.len()) {
            return Some("its active handle does not exist".to_owned());
        }
        if self.mask.is_some_and(|k| k >= self.masks.len()) {
            return Some("its active mask does not exist".to_owned());
        }
        self.settings.problem().map(str::to_owned)
    }
}

fn sorted(vertices: &[VertexId], id: &dyn Fn(VertexId) -> Option<VertexId>) -> Vec<VertexId> {
    let mut ids: Vec<VertexId> = vertices.iter().filter_map(|v| id(*v)).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

/// The ids in ascending order, with the values that belong to them.
fn sorted_with<T: Copy>(
    vertices: &[VertexId],
    values: &[T],
    id: &dyn Fn(VertexId) -> Option<VertexId>,
) -> (Vec<VertexId>, Vec<T>) {
    let pairs = vertices.iter().zip(values);
    let mut pairs: Vec<(VertexId, T)> = pairs.filter_map(|(v, x)| Some((id(*v)?, *x))).collect();
    pairs.sort_by_key(|(v, _)| *v);
    pairs.dedup_by_key(|(v, _)| *v);
    pairs.into_iter().unzip()
}

fn all_copies(mesh: &HalfedgeMesh, vertices: &[VertexId]) -> Vec<VertexId> {
    all_copies_with(mesh, vertices, &vec![(); vertices.len()]).0
}

/// The vertices with all their copies, which have the value of the first of them, in order.
fn all_copies_with<T: Copy>(
    mesh: &HalfedgeMesh,
    vertices: &[VertexId],
    values: &[T],
) -> (Vec<VertexId>, Vec<T>) {
    let mut found = BTreeMap::new();
    for (v, value) in vertices.iter().zip(values) {
        found.entry(mesh.row_of(*v)).or_insert(*value);
    }
    let copies = mesh
        .copies()
        .filter_map(|(copy, row)| Some((copy, *found.get(&row)?)));
    let copies: Vec<_> = copies.collect();
    found.extend(copies);
    found.into_iter().unzip()
}

/// The name of the group that holds the open boundary.
pub(crate) const BOUNDARY: &str = "Boundary";
