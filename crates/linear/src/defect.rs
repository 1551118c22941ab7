//! The defect of a shape, in the sense of defect correction: what each term of the system still
//! lacks. (The defects of a file are in `cotan-io`.)

use cotan_halfedge::VertexMap;
use nalgebra::Vector3;

/// By how much the current positions x miss each term of the sum that a
/// [`PreparedSystem`](crate::PreparedSystem) minimises: the input of a correction.
///
/// **Shapes**: one entry per vertex in every map.
#[derive(Clone, Copy, Debug)]
pub struct Defect<'a> {
    /// ℓ − Lx: the wanted Laplacian coordinates less the current ones.
    pub laplacian: &'a VertexMap<Vector3<f64>>,
    /// Half the negative gradient of the membrane's energy, without μ: the sum over the neighbours
    /// of the stiffness times the edge vector x_j − x_i less the wanted one. It has no sum over a
    /// component, because no shift of it changes its energy. `None` stands for zeros.
    pub tension: Option<&'a VertexMap<Vector3<f64>>>,
    /// u − x at the soft handles; other entries are ignored. `None` stands for zeros.
    pub pull: Option<&'a VertexMap<Vector3<f64>>>,
}

impl<'a> Defect<'a> {
    /// A defect of the Laplacian coordinates alone.
    pub fn of_laplacian(laplacian: &'a VertexMap<Vector3<f64>>) -> Self {
        Self {
            laplacian,
            tension: None,
            pull: None,
        }
    }

    /// Sets [`Self::tension`].
    #[must_use]
    pub fn with_tension(self, tension: &'a VertexMap<Vector3<f64>>) -> Self {
        Self {
            tension: Some(tension),
            ..self
        }
    }

    /// Sets [`Self::pull`].
    #[must_use]
    pub fn with_pull(self, pull: &'a VertexMap<Vector3<f64>>) -> Self {
        Self {
            pull: Some(pull),
            ..self
        }
    }

    /// Panics unless every map has `n` entries.
    pub(crate) fn check(&self, n: usize) {
        let others = [self.tension, self.pull];
        let has_n = |map: &&VertexMap<_>| map.len() == n;
        assert!(
            self.laplacian.len() == n && others.iter().flatten().all(has_n),
            "one entry per vertex"
        );
    }
}
