//! A scene in the form in which it is stored.

use serde::{Deserialize, Serialize};
use std::sync::Arc;

use crate::model::Model;
use crate::scene::{Props, Scene};
use crate::shape::Shape;

/// A scene in the form in which it is stored. Shapes that are the mesh as it was opened are left
/// out.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct SceneRecord {
    rest: Option<Shape>,
    shape: Option<Shape>,
    is_settled: bool,
    props: Props,
}

impl SceneRecord {
    /// Records the present scene of a model.
    pub(crate) fn of(model: &Model) -> Self {
        let scene = model.scene();
        let stored = |shape: &Shape| (shape != model.original()).then(|| shape.clone());
        Self {
            rest: stored(&scene.rest),
            shape: stored(&scene.shape),
            is_settled: scene.is_settled,
            props: Props::clone(&scene.props),
        }
    }

    /// The scene, which must be one of the model.
    ///
    /// # Errors
    /// The mismatch: files are written by anybody, and meshes change.
    pub(crate) fn scene(&self, model: &Model) -> Result<Scene, String> {
        let n = model.mesh().num_vertices();
        let original = model.original();
        let read = |shape: &Option<Shape>| -> Result<Shape, String> {
            let Some(shape) = shape else {
                return Ok(original.clone());
            };
            let is_finite = |p: &nalgebra::Point3<f64>| p.iter().all(|x| x.is_finite());
            match shape.values().position(|p| !is_finite(p)) {
                _ if shape.len() != n => Err(format!(
                    "it has {} positions where the surface has {n} vertices",
                    shape.len()
                )),
                Some(vertex) => Err(format!("its position {vertex} is not finite")),
                None => Ok(shape.clone()),
            }
        };
        if let Some(problem) = self.props.problem(n) {
            return Err(problem);
        }
        let rest = read(&self.rest)?;
        let shape = match self.shape == self.rest {
            true => rest.clone(),
            false => read(&self.shape)?,
        };
        Ok(Scene {
            rest,
            shape,
            is_settled: self.is_settled,
            props: Arc::new(self.props.clone()),
        })
    }
}
