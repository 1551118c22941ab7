//! The seam, smoothed by the paper's flow.

use std::collections::VecDeque;

use cotan_flow::{Acceleration, Flow, PrescribedField, Rest, Start, StopReason};
use cotan_geometry::{Mesh, Positions, Scalar};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::{Operator, Uniform};
use cotan_linear::{Handle, LinearSystem, SystemOptions};

use super::options::MergeOptions;
use crate::error::Error;
use crate::fair::fair_by;
use crate::smooth::{AlongCurvature, Direction, MollifiedCotangent, TargetCurvature, wanted_field};

/// A joined mesh whose seam is not yet smoothed.
pub(super) struct Seam<'a, T: Scalar> {
    pub(super) mesh: &'a Mesh<T>,
    /// Distance of each vertex from the seam in edges; 0 for vertices of the seam.
    pub(super) rings: &'a VertexMap<usize>,
    /// H of each vertex on its own surface, before the cut, in inverse units of the mesh.
    /// Arbitrary near the seam.
    pub(super) curvatures: &'a VertexMap<f64>,
}

impl<T: Scalar> Seam<'_, T> {
    /// The positions with the seam smoothed; only vertices within the band have moved.
    ///
    /// First the bending of the seam and of the ring around it is minimized (a thin plate with
    /// equal weights, which are insensitive to the slivers of a strip). On this rest shape the
    /// flow runs with the mean curvatures of both inputs, and between them, where there are none,
    /// with a field that is harmonic.
    ///
    /// **Source**: paper, section 4 (mesh merging).
    pub(super) fn blend(&self, options: &MergeOptions) -> Result<Positions<T>, Error> {
        let mesh = self.mesh.connectivity();
        if options.iterations == 0 {
            return Ok(self.mesh.positions().clone());
        }
        let may_move = |rings: usize| -> Vec<VertexId> {
            let inner = mesh.vertices().filter(|&v| !mesh.is_boundary_vertex(v));
            inner.filter(|&v| self.rings[v] <= rings).collect()
        };
        let seam = may_move(FAIRED.min(options.band));
        let faired = fair_by(&Uniform, &self.mesh.surface(), &seam)?;
        let wanted = self.filled_curvatures(&may_move(FAIRED))?;

        let mut is_held = vec![true; mesh.num_vertices()];
        for v in may_move(options.band) {
            is_held[v.index()] = false;
        }
        let held = mesh.vertices().filter(|v| is_held[v.index()]);
        let handles = held.map(|v| (Handle::hard(v), faired[v]));
        let rest = Rest::new(mesh, &faired, MollifiedCotangent::of(mesh))?;
        let edit = TargetCurvature::new(&self.mesh.surface().with_positions(&faired), &wanted);
        let field = wanted_field(&rest, &edit, Direction::Normal);
        let mut system = SystemOptions::new();
        system.max_memory = options.max_memory;
        let mut flow = Flow::on(rest)
            .system(system)
            .updater(PrescribedField(field))
            .orientation(AlongCurvature {
                // Without a tangential part the triangles of the strip become even.
                direction: Direction::NormalAlone,
            })
            .handles(handles)
            .start(Start::Original)
            .acceleration(Acceleration::Off)
            .tolerance(0.0)
            // The first solve of a flow only locates its original mesh.
            .iteration_limit(options.iterations + 1)
            .build()?;
        let report = flow.run(|_, _| std::ops::ControlFlow::Continue(()))?;
        if report.stop == StopReason::Cancelled {
            return Err(Error::Cancelled);
        }
        Ok(flow.positions())
    }

    /// The curvatures, replaced at these vertices by the harmonic field (with equal weights) that
    /// the others determine.
    fn filled_curvatures(&self, missing: &[VertexId]) -> Result<VertexMap<f64>, Error> {
        let mesh = self.mesh.connectivity();
        let mut given = self.curvatures.clone();
        let mut is_missing = vec![false; mesh.num_vertices()];
        for &v in missing {
            is_missing[v.index()] = true;
            given[v] = 0.0;
        }
        let known: Vec<VertexId> = mesh.vertices().filter(|v| !is_missing[v.index()]).collect();
        let operator = Operator::assemble(&Uniform, &self.mesh.surface())?;
        let system = LinearSystem::poisson(&operator, &known)?;
        Ok(system.solve(&given))
    }
}

/// The number of edges from each vertex to the nearest of `from`.
pub(super) fn rings_around(mesh: &HalfedgeMesh, from: &[VertexId]) -> VertexMap<usize> {
    let mut rings = VertexMap::filled(mesh.num_vertices(), usize::MAX);
    let mut open: VecDeque<VertexId> = from.iter().copied().collect();
    for &v in from {
        rings[v] = 0;
    }
    while let Some(v) = open.pop_front() {
        for j in mesh.one_ring(v) {
            if rings[j] == usize::MAX {
                rings[j] = rings[v] + 1;
                open.push_back(j);
            }
        }
    }
    rings
}

/// The number of rings around the seam that are faired. Their own curvature is ignored.
const FAIRED: usize = 1;
