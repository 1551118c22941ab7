//! A custom energy, minimized by L-BFGS, with one rotation for the whole shape. E(x, R) = |L⁰x −
//! R ℓ⁰|² with a single R: the local step finds R, the solve of the flow finds x.
//!
//! `cargo run -p cotan --example own_energy`

use cotan::flow::{
    Energy, FirstGuess, FittedCells, FlowError, FlowState, LocalGlobal, NextStep, Rest, Winding,
    nearest_rotation,
};
use cotan::linear::Handle;
use cotan::prelude::*;

struct OneRotation;

impl LocalGlobal<f64> for OneRotation {
    fn begin(&mut self, _: &Rest<f64>) -> Result<f64, FlowError> {
        Ok(0.0)
    }

    fn point_radius(&self, _: &Rest<f64>) -> f64 {
        0.0
    }

    fn start_from(&mut self, _: &FirstGuess) {}

    fn wind(&mut self, _: Option<&Winding>) {}

    fn fit(
        &mut self,
        state: &FlowState<'_, f64>,
        field: &VertexMap<f64>,
        out: &mut VertexMap<Vector3<f64>>,
    ) -> Result<Energy, FlowError> {
        let (rest, now) = (state.rest(), state.rest_laplacian());
        let wanted = |v| rest.laplacian()[v] * (field[v] / rest.magnitudes()[v].max(1e-30));
        let covariance: Matrix3<f64> = now.iter().map(|(v, l)| l * wanted(v).transpose()).sum();
        let rotation = nearest_rotation(&covariance);
        let mut energy = Energy::default();
        for (v, ell) in now.iter() {
            out[v] = rotation * wanted(v);
            energy.value += (ell - out[v]).norm_squared();
            energy.size += ell.norm_squared() + out[v].norm_squared();
        }
        Ok(energy)
    }

    fn wanted_tension(&self, _: &Rest<f64>, _: NextStep, out: &mut VertexMap<Vector3<f64>>) {
        out.values_mut().for_each(|t| *t = Vector3::zeros());
    }

    fn cells(&self) -> Option<FittedCells<'_>> {
        None
    }
}

fn main() -> Result<(), cotan::Error> {
    let shape = cotan::shapes::torus::<f64>(1.0, 0.4, 48, 24);
    let turn = Isometry3::rotation(Vector3::new(0.4, 1.1, -0.3));
    let turned = |v| turn * shape.positions()[v];
    let few = shape.connectivity().vertices().step_by(200);
    let mut flow = Flow::builder(shape.connectivity(), shape.positions())
        .handles(few.map(|v| (Handle::hard(v), turned(v))))
        .energy(OneRotation)
        .tolerance(1e-9)
        .build()?;
    let report = flow.run_to_end()?;
    let positions = flow.positions();
    let misses = positions.iter().map(|(v, p)| (turned(v) - p).norm());
    let (off, steps) = (misses.fold(0.0, f64::max), report.iterations);
    println!("{} after {steps} steps, {off:.0e} off", report.stop);
    Ok(())
}
