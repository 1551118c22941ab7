//! A custom Laplacian scheme: a material that is softer in some places.
//!
//! A scheme only chooses a weight for each edge. Here the cotangent weights are reduced in the
//! middle of a bar, so that the bend concentrates there as in a joint.
//!
//! `cargo run -p cotan --example custom_scheme`

use std::ops::ControlFlow;

use cotan::flow::BestRotation;
use cotan::geometry::scalar;
use cotan::halfedge::HalfedgeMap;
use cotan::laplacian::{Cotangent, LaplacianScheme, SchemeError, Symmetry};
use cotan::linear::Handle;
use cotan::prelude::*;

/// Cotangent weights times the mean stiffness of the two ends of the edge.
struct Material {
    stiffness: VertexMap<f64>,
}

impl<T: Scalar> LaplacianScheme<T> for Material {
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        Cotangent::default().weights(surface, out)?;
        let mesh = surface.mesh();
        for h in mesh.halfedges() {
            let [a, b] = [mesh.origin(h), mesh.target(h)].map(|v| self.stiffness[v]);
            out[h] *= scalar(0.5 * (a + b));
        }
        Ok(())
    }

    /// Both directions of an edge have the same factor.
    fn symmetry(&self) -> Symmetry {
        Symmetry::Symmetric
    }

    /// Appears in error messages.
    fn name(&self) -> &str {
        "material"
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shape = cotan::shapes::bar::<f64>([6.0, 1.0, 1.0], [36, 6, 6]);
    let surface = shape.surface();
    let left = surface.vertices_where(|p| p.x < -2.99);
    let right = surface.vertices_where(|p| p.x > 2.99);
    let turn = Isometry3::rotation(Vector3::z() * BEND);
    let targets: Vec<_> = left
        .iter()
        .map(|&v| (Handle::hard(v), shape.positions()[v]))
        .chain(
            right
                .iter()
                .map(|&v| (Handle::hard(v), turn * shape.positions()[v])),
        )
        .collect();

    for (name, softness) in [("even", 1.0), ("soft in the middle", 0.1)] {
        let stiffness = shape
            .positions()
            .map(|p| if p.x.abs() < 0.5 { softness } else { 1.0 });
        let mut flow = Flow::builder(shape.connectivity(), shape.positions())
            .scheme(Material { stiffness })
            // The default energy has a membrane, which is based on the shape but not on the
            // material.
            .orientation(BestRotation::new())
            .handles(targets.iter().copied())
            .build()?;
        let report = flow.run(|_, _| ControlFlow::Continue(()))?;
        let positions = flow.positions();
        let bend =
            section_angle(&surface, &positions, 0.5) - section_angle(&surface, &positions, -0.5);
        println!(
            "{name}: {} after {} iterations",
            report.stop, report.iterations
        );
        println!(
            "  {:.1}° of {:.1}° in the middle sixth",
            bend.to_degrees(),
            BEND.to_degrees()
        );
    }
    Ok(())
}

/// The angle by which the right end is turned, in radians.
const BEND: f64 = 1.0;

/// The rotation about z of the bar's cross-section at `x`, given by the position of its upper
/// vertices relative to its lower ones.
fn section_angle(original: &Surface<'_, f64>, positions: &Positions<f64>, x: f64) -> f64 {
    let section = original.vertices_where(|p| (p.x - x).abs() < 1e-6);
    let up = section
        .iter()
        .fold(Vector3::zeros(), |up: Vector3<f64>, &v| {
            up + positions[v].coords * original.position(v).y
        });
    (-up.x).atan2(up.y)
}
