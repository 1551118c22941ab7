//! The paper's iteration to the sphere, in its plain and its robust form: the generic flow with
//! constant curvature and one point handle.

use std::ops::ControlFlow;

use cotan_flow::{AlongNormal, Flow, FlowError, Report, Schedule, Start, StepReport};
use cotan_geometry::{Positions, Surface};
use cotan_halfedge::{HalfedgeMap, HalfedgeMesh, VertexId};
use cotan_laplacian::{LaplacianScheme, OneRings, Operator, SchemeError, Symmetry};
use cotan_linear::{Handle, SystemOptions};
use nalgebra::Point3;

use super::curvature::{AreaMeasure, ConstantCurvature};
use super::options::SphereOptions;
use super::project::{KeepSize, RobustProjection};
use super::round::{normalized, sphere_centre};

/// A callback that receives each step and may stop the run.
pub(crate) type Observer<'a> = &'a mut dyn FnMut(&StepReport) -> ControlFlow<()>;

/// The result of an iteration: on the unit sphere, but not checked.
pub(crate) struct Iterated {
    pub(crate) positions: Positions<f64>,
    pub(crate) report: Report,
    pub(crate) factorizations: usize,
}

/// The iteration of the paper (section 4.1): ℓ = 4 A κ n, with a step ratio that falls from 1 to
/// 0.1. With Tutte weights the tangential part of ℓ is kept. The scale, which the paper leaves
/// open and which is unstable, is fixed in each step. The result is projected radially.
pub(crate) fn paper(
    mesh: &HalfedgeMesh,
    positions: &Positions<f64>,
    options: &SphereOptions,
    observer: Observer<'_>,
) -> Result<Iterated, FlowError> {
    let scheme = options.scheme.scheme::<f64>();
    let orientation = match scheme.symmetry() {
        Symmetry::Symmetric => AlongNormal::NormalOnly,
        Symmetry::General => AlongNormal::KeepTangential,
    };
    let mut flow = Flow::builder(mesh, positions)
        .scheme(scheme)
        .updater(ConstantCurvature::keeping_scale(AreaMeasure::Ring))
        .projected(orientation, KeepSize::default())
        .handles([one_handle(positions)])
        .schedule(Schedule::PAPER)
        .start(Start::Updated)
        .tolerance(options.tolerance)
        .iteration_limit(options.iteration_limit)
        .system(system(options))
        .build()?;
    let report = flow.run(|_, step| observer(step))?;
    let mut positions = flow.box_positions().clone();
    let centre = sphere_centre(positions.as_slice());
    for p in positions.values_mut() {
        p.coords = normalized(p.coords - centre);
    }
    Ok(Iterated {
        positions,
        report,
        factorizations: 1,
    })
}

/// The robust variant: see [`RobustProjection`]. `first` is a map to start from, and small
/// weights are raised around the vertices in `marked`.
pub(crate) fn robust(
    mesh: &HalfedgeMesh,
    positions: &Positions<f64>,
    options: &SphereOptions,
    marked: &[bool],
    first: Option<Positions<f64>>,
    observer: Observer<'_>,
) -> Result<Iterated, FlowError> {
    let scheme = Selective {
        scheme: options.scheme.symmetric_scheme(),
        marked: marked.to_vec(),
    };
    let mut builder = Flow::builder(mesh, positions)
        .scheme(scheme)
        .updater(ConstantCurvature::keeping_scale(AreaMeasure::Vector))
        .projected(AlongNormal::NormalOnly, RobustProjection::new())
        .handles([one_handle(positions)])
        .start(Start::Updated)
        .tolerance(options.tolerance)
        .iteration_limit(options.iteration_limit)
        .system(system(options));
    if let Some(first) = first {
        builder = builder.first_shape(first);
    }
    let mut flow = builder.build()?;
    let report = flow.run(|_, step| observer(step))?;
    let mut positions = flow.box_positions().clone();
    positions
        .values_mut()
        .for_each(|p| p.coords = normalized(p.coords));
    Ok(Iterated {
        positions,
        report,
        factorizations: 1,
    })
}

fn system(options: &SphereOptions) -> SystemOptions {
    let mut system = SystemOptions::new();
    system.max_memory = options.max_memory;
    system
}

/// The point handle that fixes the position of the mesh.
fn one_handle(positions: &Positions<f64>) -> (Handle, Point3<f64>) {
    let vertex = VertexId::new(0);
    let at = positions.get(vertex).copied().unwrap_or_default();
    (Handle::hard(vertex), at)
}

/// A scheme on the edges of the mesh whose weights are raised to a lower bound on edges with a
/// marked end. Without marks, any scheme.
struct Selective {
    scheme: Box<dyn LaplacianScheme<f64>>,
    marked: Vec<bool>,
}

/// Smaller weights cause flips; an equilateral mesh has weights of 1.15.
const FLOOR: f64 = 0.01;

impl LaplacianScheme<f64> for Selective {
    fn weights(
        &self,
        surface: &Surface<'_, f64>,
        out: &mut HalfedgeMap<f64>,
    ) -> Result<(), SchemeError> {
        self.scheme.weights(surface, out)?;
        let mesh = surface.mesh();
        for e in mesh.edges() {
            if mesh
                .edge_vertices(e)
                .iter()
                .any(|v| self.marked.get(v.index()) == Some(&true))
            {
                for h in e.halfedges() {
                    out[h] = out[h].max(FLOOR);
                }
            }
        }
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        self.scheme.symmetry()
    }

    fn operator(
        &self,
        rings: &OneRings,
        surface: &Surface<'_, f64>,
    ) -> Result<Operator<f64>, SchemeError> {
        match self.marked.contains(&true) {
            true => Operator::assemble_on(rings, self, surface),
            false => self.scheme.operator(rings, surface),
        }
    }

    fn name(&self) -> &str {
        self.scheme.name()
    }
}
