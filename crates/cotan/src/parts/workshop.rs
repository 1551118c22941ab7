//! The flows of large parts that follow, each built when its part first moves.

use cotan_flow::{Flow, Hybrid, Rest, Start};
use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{HalfedgeMesh, VertexId};
use cotan_laplacian::Cotangent;

use super::contacts::Contact;
use super::extract::Extract;
use super::passenger::{Flowing, Kind};
use super::plan::Neighbourhood;
use crate::error::Error;
use crate::options::DeformOptions;

/// A model, from which flows of its parts are built.
pub(crate) struct Workshop<'a, T: Scalar> {
    pub(crate) neighbourhood: &'a Neighbourhood,
    pub(crate) mesh: &'a HalfedgeMesh,
    pub(crate) original: &'a Positions<T>,
    pub(crate) options: &'a DeformOptions,
}

impl<T: Scalar> Workshop<'_, T> {
    /// The kind of a large part with these contacts: if its weights cannot be computed or solved,
    /// it follows as a rigid body.
    pub(crate) fn kind(&self, part: usize, contacts: &[Contact]) -> Kind<T> {
        match self.flowing(part, contacts) {
            Ok(flowing) => Kind::Flowing(Box::new(flowing)),
            Err(error) => {
                tracing::debug!(part, %error, "a part is placed as a rigid body");
                Kind::Rigid
            }
        }
    }

    /// The flow of a large part, with the bending length of the whole model.
    fn flowing(&self, part: usize, contacts: &[Contact]) -> Result<Flowing<T>, Error> {
        let (model, length) = (&self.neighbourhood.model, self.neighbourhood.length);
        let options = self.options;
        let is_own = |v: VertexId| model.part_of(v) == part;
        let extract = Extract::new(self.mesh, self.original, is_own);
        let rest = Rest::new(
            extract.mesh.clone(),
            extract.positions.clone(),
            Cotangent::default(),
        )?;
        let (own, size) = (&model.parts[part], model.extent_of(part));
        // μ of the hybrid. Springs of handles are relative to the mean diagonal.
        let membrane = 4.0 * own.area / own.vertices.len() as f64 / (length * length);
        let factor = membrane / rest.operator().mean_diagonal().powi(2);
        let pulls = Flowing::pulls(contacts, &extract);
        let handles = Flowing::handles(&pulls, factor, &extract);
        let flow = Flow::on(rest)
            .energy(Hybrid::new(length / size).stiffness(options.stiffness))
            .start(Start::Original)
            .acceleration(options.acceleration)
            .tolerance(options.tolerance)
            .iteration_limit(options.iteration_limit)
            .system(options.system)
            .handles(handles)
            .build()?;
        Ok(Flowing {
            extract,
            flow,
            pulls,
        })
    }
}
