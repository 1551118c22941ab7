//! An orientation that wraps another one: any rule, restricted to one side of a plane.
//!
//! `cargo run -p cotan --example wrapped_orientation`

use cotan::flow::{BestRotation, FlowError, FlowState, Limited, Orientation};
use cotan::linear::Handle;
use cotan::prelude::*;

/// Applies the rule where x > 0 relative to the middle of the original. The rest keeps its
/// original directions.
struct RightHalf<O>(O);

impl<T: Scalar, O: Orientation<T>> Orientation<T> for RightHalf<O> {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        self.0.orient(state, field, out)?;
        let rest = state.rest();
        let middle = rest.box_units().to_box(Point3::origin()).x;
        for (v, original) in rest.laplacian().iter() {
            if rest.positions()[v].x < middle {
                out[v] = *original;
            }
        }
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shape = cotan::shapes::bar::<f64>([6.0, 1.0, 1.0], [36, 6, 6]);
    let ends = shape.surface().vertices_where(|p| p.x.abs() > 2.99);
    let turn = Isometry3::rotation(Vector3::z() * 0.8);
    let handles = ends.iter().map(|&v| {
        let p = shape.positions()[v];
        (Handle::hard(v), if p.x > 0.0 { turn * p } else { p })
    });
    let rules: [(&str, Box<dyn Orientation<f64>>); 3] = [
        ("best rotation", Box::new(BestRotation::new())),
        ("limited, right half", Box::new(RightHalf(Limited::new()))),
        (
            "best rotation, right half",
            Box::new(RightHalf(BestRotation::new())),
        ),
    ];
    for (name, rule) in rules {
        let builder =
            Flow::builder(shape.connectivity(), shape.positions()).handles(handles.clone());
        let mut flow = builder.orientation(rule).build()?;
        let report = flow.run_to_end()?;
        println!(
            "{name}: {} after {} iterations",
            report.stop, report.iterations
        );
    }
    Ok(())
}
