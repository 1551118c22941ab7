//! Edits of the curvature in one call.

use std::ops::ControlFlow;

use cotan_flow::PrescribedField;
use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::HalfedgeMesh;

use super::{CurvatureEdit, wanted_field};
use crate::error::Error;
use crate::handles::Handles;
use crate::smooth::anchored::{Anchored, Boundary, InteriorCotangent, held};
use crate::smooth::curvature::{AlongCurvature, Direction};
use crate::smooth::preserve::{Correction, Preserve};

/// The settings of [`edit_detail`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DetailOptions {
    /// μ > 0: how firmly every vertex is held where it was; smaller lets coarse changes through.
    pub anchor: f64,
    /// How often. 0 changes nothing.
    pub iterations: usize,
    /// What the field is the size of.
    pub direction: Direction,
    /// What happens to the boundary.
    pub boundary: Boundary,
    /// What is kept exactly.
    pub preserve: Preserve,
    /// No vertex moves farther than this, in the units of the mesh; handles excepted.
    pub max_displacement: Option<f64>,
}

impl Default for DetailOptions {
    fn default() -> Self {
        Self {
            anchor: 0.5,
            iterations: 20,
            direction: Direction::default(),
            boundary: Boundary::default(),
            preserve: Preserve::default(),
            max_displacement: None,
        }
    }
}

/// Rebuilds a mesh from the mean curvatures that an edit wants.
///
/// Target field and areas are those of the input; normals are those of the current surface. An edit that
/// changes nothing leaves the mesh as it is, up to rounding.
///
/// **Shapes**: one position a vertex. `handles` may hold further vertices, or move some.
///
/// # Errors
/// [`Error`] for a mesh that is no surface, handles that do not exist, a field of the wrong length, and
/// positions that run away.
///
/// **Source**: paper, section 4.2; the anchors and the use of the input's areas are ours.
pub fn edit_detail<T: Scalar>(
    mesh: &HalfedgeMesh,
    positions: &Positions<T>,
    handles: &Handles<T>,
    edit: &impl CurvatureEdit,
    options: &DetailOptions,
) -> Result<Positions<T>, Error> {
    let observer = |_| ControlFlow::Continue(());
    edit_detail_observed(mesh, positions, handles, edit, options, &observer)
}

/// As [`edit_detail`]; the observer sees the number of every iteration as it ends, and may stop the job.
///
/// # Errors
/// As [`edit_detail`], and [`Error::Cancelled`] if the observer stopped it.
pub fn edit_detail_observed<T: Scalar>(
    mesh: &HalfedgeMesh,
    positions: &Positions<T>,
    handles: &Handles<T>,
    edit: &impl CurvatureEdit,
    options: &DetailOptions,
    observer: &(dyn Fn(usize) -> ControlFlow<()> + Sync),
) -> Result<Positions<T>, Error> {
    edit.check(mesh.num_vertices())?;
    let held = held(mesh, positions, options.boundary, handles)?;
    if options.iterations == 0 {
        return Ok(positions.clone());
    }
    let system = Anchored {
        mesh,
        rest: positions,
        data: positions,
        anchor: Some(options.anchor),
        boundary: options.boundary,
        handles,
        iterations: options.iterations,
        observer,
    };
    let direction = options.direction;
    let rest = system.rest(InteriorCotangent::of(mesh))?;
    let updater = PrescribedField(wanted_field(&rest, edit, direction));
    let edited = system.run(rest, updater, AlongCurvature { direction })?;
    let correction = Correction {
        mesh,
        original: positions,
        held: &held,
        preserve: options.preserve,
        bound: options.max_displacement,
    };
    correction.apply(&edited)
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{bumpy_plane, icosphere, torus};
    use cotan_geometry::{Shape, volume};
    use cotan_halfedge::VertexMap;

    use super::*;
    use crate::smooth::{
        BandPass, Blend, ScaledCurvature, Sequence, Sum, TargetCurvature, TransferredCurvature,
        mean_curvature_rms, mean_curvatures, with_normal_noise,
    };

    fn edited(shape: &Shape<f64>, edit: &impl CurvatureEdit) -> Positions<f64> {
        let options = DetailOptions::default();
        edit_detail(
            &shape.mesh,
            &shape.positions,
            &Handles::new(),
            edit,
            &options,
        )
        .unwrap()
    }

    fn rough() -> Shape<f64> {
        let mut shape = torus::<f64>(1.0, 0.4, 40, 20);
        shape.positions = with_normal_noise(&shape.surface(), 0.01, 9);
        shape
    }

    fn farthest(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
        let pairs = a.values().zip(b.values());
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn edits_that_ask_for_what_is_there_are_the_identity() {
        for shape in [rough(), bumpy_plane::<f64>([2.0, 2.0], [20, 20], 0.1)] {
            let same = ScaledCurvature::by(1.0);
            let surface = shape.surface();
            let mask: VertexMap<f64> = shape.positions.map(|p| 0.5 + 0.1 * p.x);
            let edits: [Box<dyn CurvatureEdit>; 7] = [
                Box::new(same),
                Box::new(BandPass::default()),
                Box::new(TransferredCurvature::from(&surface)),
                Box::new(TargetCurvature::new(&surface, &mean_curvatures(&surface))),
                Box::new(Sum(same, BandPass::default())),
                Box::new(Sequence(same, same)),
                Box::new(Blend {
                    mask,
                    off: same,
                    on: BandPass::default(),
                }),
            ];
            for (k, edit) in edits.iter().enumerate() {
                let off = farthest(&edited(&shape, edit), &shape.positions);
                assert!(off < 1e-9, "edit {k}: {off:e}");
            }
        }
    }

    #[test]
    fn details_grow_and_fade_and_the_volume_stays() {
        let shape = rough();
        let surface = shape.surface();
        // What there is beside the torus's own.
        let own = mean_curvature_rms(&torus::<f64>(1.0, 0.4, 40, 20).surface());
        let curved = |x: &Positions<f64>| mean_curvature_rms(&surface.with_positions(x)) - own;
        let [faded, doubled] = [0.0, 2.0].map(|f| edited(&shape, &ScaledCurvature::by(f)));
        let all = [curved(&faded), curved(&shape.positions), curved(&doubled)];
        assert!(all[0] < 0.5 * all[1], "{all:?}");
        assert!(all[2] > 1.3 * all[1], "{all:?}");
        for x in [&faded, &doubled] {
            let ratio = volume(&surface.with_positions(x)) / volume(&surface);
            // As much as on the public models of the reference (1.013).
            assert!((ratio - 1.0).abs() < 0.015, "{ratio}");
        }
    }

    #[test]
    fn a_target_field_is_met() {
        let shape = icosphere::<f64>(4);
        let wanted = shape.positions.map(|p| 1.0 + 3.0 * (25.0 * p.z).sin());
        let x = edited(&shape, &TargetCurvature::new(&shape.surface(), &wanted));
        let now = mean_curvatures(&shape.surface().with_positions(&x));
        let pairs = || {
            now.values()
                .zip(wanted.values())
                .map(|(a, b)| (a - 1.0, b - 1.0))
        };
        let product: f64 = pairs().map(|(a, b)| a * b).sum();
        let sizes: [f64; 2] = [
            pairs().map(|(a, _)| a * a).sum(),
            pairs().map(|(_, b)| b * b).sum(),
        ];
        let correlation = product / (sizes[0] * sizes[1]).sqrt();
        assert!(correlation > 0.95, "{correlation}");
    }

    #[test]
    fn fields_of_the_wrong_length_are_refused() {
        let (small, large) = (icosphere::<f64>(1), icosphere::<f64>(2));
        let edit = TransferredCurvature::from(&small.surface());
        let options = DetailOptions::default();
        let result = edit_detail(
            &large.mesh,
            &large.positions,
            &Handles::new(),
            &edit,
            &options,
        );
        assert!(matches!(result, Err(Error::FieldLength { len: 42, .. })));
    }
}
