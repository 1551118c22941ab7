//! The picture of the model: camera, renderer, and how it looks.

use std::sync::{Arc, Mutex, MutexGuard};

use cotan::geometry::{BoundingBox, Surface, TriangleTree};
use cotan::halfedge::{VertexId, VertexMap};
use cotan_workspace::meter::Reading;
use cotan_workspace::{Model, Shape, lock};
use eframe::glow;
use nalgebra::Vector3;

use crate::view::{Camera, Light, Picker, Renderer, Shading};

/// The picture of the model.
pub(super) struct Shown {
    pub(super) camera: Camera,
    pub(super) looks: Looks,
    renderer: Arc<Mutex<Renderer>>,
    /// The shape that the renderer has.
    drawn: Option<Shape>,
    /// The search tree for picking, with its shape.
    picker: Option<(Shape, Picker)>,
    /// The vertices that are not shown.
    hidden: Vec<VertexId>,
    /// The last measurement.
    reading: Option<Reading>,
}

/// The display settings of the mesh.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Looks {
    pub(super) shading: Shading,
    pub(super) light: Light,
    pub(super) has_wireframe: bool,
    pub(super) has_normals: bool,
    /// True while the shape as it was opened is shown, to compare.
    pub(super) is_before: bool,
}

impl Shown {
    pub(super) fn new(gl: &Arc<glow::Context>) -> Result<Self, String> {
        Ok(Self {
            camera: Camera::new(&cotan::shapes::icosphere::<f64>(0).surface().bounding_box()),
            looks: Looks::default(),
            renderer: Arc::new(Mutex::new(Renderer::new(gl)?)),
            drawn: None,
            picker: None,
            hidden: Vec::new(),
            reading: None,
        })
    }

    /// Shows a model that was opened.
    pub(super) fn open(&mut self, model: &Model, tree: TriangleTree) {
        let shape = &model.scene().shape;
        self.camera = Camera::new(&model.surface(shape).bounding_box());
        self.renderer().set_mesh(model.mesh());
        self.drawn = None;
        self.hidden.clear();
        self.looks.is_before = false;
        self.reading = None;
        self.picker = Some((shape.clone(), Picker::from_tree(tree, shape.positions())));
    }

    /// Leaves out the faces of vertices that are hidden.
    pub(super) fn hide(&mut self, model: &Model, hidden: &[VertexId]) {
        if self.hidden != hidden {
            self.hidden = hidden.to_vec();
            self.picker = None;
            self.renderer().set_hidden(model.mesh(), hidden);
        }
    }

    pub(super) fn renderer(&self) -> MutexGuard<'_, Renderer> {
        lock(&self.renderer)
    }

    /// The renderer, for a paint callback.
    pub(super) fn shared_renderer(&self) -> Arc<Mutex<Renderer>> {
        Arc::clone(&self.renderer)
    }

    /// Hands a shape to the renderer.
    pub(super) fn draw(&mut self, shape: &Shape, normals: &VertexMap<Vector3<f64>>) {
        self.renderer().set_shape(shape.positions(), normals);
        self.drawn = Some(shape.clone());
    }

    /// Hands the shape on the screen to the renderer, if it does not have it.
    pub(super) fn bring_up_to_date(&mut self, model: &Model, shape: &Shape) {
        let is_drawn = self.drawn.as_ref().is_some_and(|drawn| drawn.is(shape));
        if !is_drawn && let Ok(surface) = Surface::new(model.mesh(), shape.positions()) {
            let normals = surface.vertex_normals();
            self.draw(shape, &normals);
        }
    }

    pub(super) fn set_colors(&mut self, reading: Reading) {
        let colors = reading
            .colors
            .as_ref()
            .map(|(.., colors)| colors.as_slice());
        self.renderer().set_colors(colors);
        self.reading = Some(reading);
    }

    /// The last measurement.
    pub(super) fn reading(&self) -> Option<&Reading> {
        self.reading.as_ref()
    }

    /// The search tree of a shape.
    pub(super) fn picker(&mut self, model: &Model, shape: &Shape) -> &Picker {
        let picker = match self.picker.take() {
            Some((of, picker)) if of.is(shape) => picker,
            Some((_, mut picker)) if picker.positions().len() == shape.len() => {
                picker.refit(shape.positions());
                picker
            }
            _ => Picker::without(model.mesh(), shape.positions(), &self.hidden),
        };
        &self.picker.insert((shape.clone(), picker)).1
    }

    /// Fits the view to a shape.
    pub(super) fn fit(&mut self, bounds: &BoundingBox<f64>) {
        self.camera.fit(bounds);
    }
}
