//! Instruction counts of the kernels, which show a regression even on the noisiest machine.
//!
//! Run by `scripts/instructions.sh`, which skips it if valgrind or the runner is missing.

use std::hint::black_box;

use cotan::flow::{Flow, StepReport};
use cotan::laplacian::{Cotangent, OneRings, Operator};
use cotan::linear::PreparedSystem;
use cotan::prelude::*;
use cotan_instructions::{
    Solve, faces, hybrid_flow, operator, prepare, rotation_flow, shape, solve_setup, thin_flow,
};
use gungraun::{library_benchmark, library_benchmark_group, main};

#[library_benchmark]
#[bench::irregular(faces())]
fn halfedge_build((num_vertices, faces): (usize, Vec<[u32; 3]>)) -> HalfedgeMesh {
    HalfedgeMesh::from_faces(num_vertices, black_box(&faces)).expect("a closed mesh")
}

#[library_benchmark]
#[bench::irregular(shape())]
fn one_rings(shape: Mesh<f64>) -> OneRings {
    OneRings::new(black_box(shape.connectivity()))
}

#[library_benchmark]
#[bench::irregular(shape())]
fn weights_and_assembly(shape: Mesh<f64>) -> Operator<f64> {
    let surface = shape.surface();
    Operator::assemble(&Cotangent::default(), black_box(&surface)).expect("finite weights")
}

#[library_benchmark]
#[bench::irregular(shape())]
fn normals(shape: Mesh<f64>) -> VertexMap<Vector3<f64>> {
    black_box(&shape.surface()).vertex_normals()
}

#[library_benchmark]
#[bench::handles(operator())]
fn prepare_system(operator: Operator<f64>) -> PreparedSystem {
    prepare(black_box(&operator))
}

#[library_benchmark]
#[bench::handles(solve_setup())]
fn solve(solve: Solve) -> Solve {
    black_box(solve).run()
}

#[library_benchmark]
#[bench::rotation(rotation_flow())]
#[bench::hybrid(hybrid_flow())]
#[bench::thin(thin_flow())]
fn step(mut flow: Flow<f64>) -> (Flow<f64>, StepReport) {
    let report = flow.step().expect("built-in updaters do not fail");
    (flow, report)
}

library_benchmark_group!(
    name = mesh;
    benchmarks = halfedge_build, one_rings, weights_and_assembly, normals
);
library_benchmark_group!(
    name = system;
    benchmarks = prepare_system, solve, step
);
main!(library_benchmark_groups = mesh, system);
