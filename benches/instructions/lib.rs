//! The input of the counted kernels: a closed irregular mesh of 2,562 vertices, 32 of them
//! handles.

use cotan::flow::{BestRotation, Flow, FlowBuilder, Hybrid};
use cotan::laplacian::{Cotangent, Operator};
use cotan::linear::{Defect, Handle, Membrane, PreparedSystem};
use cotan::prelude::*;
use cotan::shapes::{VertexOrder, irregular};

/// Makes the calling thread the only one of rayon. callgrind counts on the thread that calls the
/// kernel, and would miss work done by others.
fn stay_on_this_thread() {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .use_current_thread();
    // Refused if it was done before.
    let _ = pool.build_global();
}

/// The mesh with random numbering. It fits in the caches in any order.
pub fn shape() -> Mesh<f64> {
    stay_on_this_thread();
    irregular(2_562, VertexOrder::Random, 1)
}

/// The number of vertices, and the faces.
pub fn faces() -> (usize, Vec<[u32; 3]>) {
    let shape = shape();
    let corners = |f| shape.connectivity().triangle(f).map(|v| v.index() as u32);
    (
        shape.positions().len(),
        shape.connectivity().faces().map(corners).collect(),
    )
}

/// A flow whose handles have moved and that has made two steps.
pub fn flow(choose: impl FnOnce(FlowBuilder<f64>) -> FlowBuilder<f64>) -> Flow<f64> {
    let shape = shape();
    let held = handles().map(|h| (h, shape.positions()[h.vertex]));
    let mut flow = choose(Flow::builder(shape.connectivity(), shape.positions()))
        .handles(held)
        .tolerance(0.0)
        .build()
        .expect("a closed surface with handles");
    let moved: Vec<_> = handles()
        .map(|h| (h.vertex, shape.positions()[h.vertex] * 1.1))
        .collect();
    flow.move_handles(&moved).expect("these are handles");
    for _ in 0..2 {
        flow.step().expect("built-in updaters do not fail");
    }
    flow
}

/// The flow with the paper's linear system alone.
pub fn rotation_flow() -> Flow<f64> {
    flow(|flow| flow.orientation(BestRotation::new()))
}

/// The default flow.
pub fn hybrid_flow() -> Flow<f64> {
    flow(|flow| flow.energy(Hybrid::default()))
}

/// The input of one solve.
pub struct Solve {
    system: PreparedSystem,
    mismatch: VertexMap<Vector3<f64>>,
    residual: VertexMap<Vector3<f64>>,
    correction: VertexMap<Vector3<f64>>,
}

/// The operator of the mesh.
pub fn operator() -> Operator<f64> {
    Operator::assemble(&Cotangent::default(), &shape().surface()).expect("finite weights")
}

/// Analysis and factorization, without a membrane.
pub fn prepare(operator: &Operator<f64>) -> PreparedSystem {
    let handles: Vec<Handle> = handles().collect();
    PreparedSystem::prepare(operator, &handles, None::<Membrane<'_>>).expect("held")
}

/// A prepared solve.
pub fn solve_setup() -> Solve {
    let operator = operator();
    let still = VertexMap::filled(operator.num_rows(), Vector3::zeros());
    let mut mismatch = still.clone();
    operator.apply(shape().positions(), &mut mismatch);
    Solve {
        system: prepare(&operator),
        mismatch,
        residual: still.clone(),
        correction: still,
    }
}

impl Solve {
    /// Runs one correction.
    pub fn run(mut self) -> Self {
        let defect = Defect::of_laplacian(&self.mismatch);
        self.system.residual(&defect, &mut self.residual);
        self.system
            .correct(&defect, &mut self.correction)
            .expect("a solution");
        self
    }
}

fn handles() -> impl Iterator<Item = Handle> {
    (0..32).map(|k| Handle::hard(VertexId::new(80 * k)))
}
