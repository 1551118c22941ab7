//! One-call function for curvature edits.

use std::ops::ControlFlow;

use cotan_flow::PrescribedField;
use cotan_geometry::{Positions, Scalar, Surface};

use super::{CurvatureEdit, wanted_field};
use crate::error::Error;
use crate::handles::Handles;
use crate::named::setters;
use crate::smooth::anchored::{Anchored, Boundary, held};
use crate::smooth::curvature::{AlongCurvature, Direction};
use crate::smooth::mask::Mask;
use crate::smooth::mollified::MollifiedCotangent;
use crate::smooth::preserve::{Correction, Preserve};
use crate::smooth::unfold::without_new_folds;

/// The settings of [`edit_detail`].
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct DetailOptions {
    /// μ > 0: the firmness with which each vertex is held in place. Smaller values allow coarser
    /// changes.
    pub anchor: f64,
    /// The number of iterations. 0 changes nothing.
    pub iterations: usize,
    /// The quantity described by the field.
    pub direction: Direction,
    /// The treatment of the boundary.
    pub boundary: Boundary,
    /// The quantity that is preserved exactly.
    pub preserve: Preserve,
    /// The maximum displacement of any vertex except handles, in the units of the mesh. The
    /// default is a quarter of the longest side of the bounding box, which is farther than any
    /// detail reaches.
    pub max_displacement: Option<f64>,
    /// The memory limit of the factorization in bytes; see [`cotan_linear::SystemOptions`].
    pub max_memory: Option<u64>,
}

setters!(DetailOptions {
    anchor: f64,
    iterations: usize,
    direction: Direction,
    boundary: Boundary,
    preserve: Preserve,
    max_displacement: impl Into<Option<f64>>,
    max_memory: impl Into<Option<u64>>,
});

impl Default for DetailOptions {
    fn default() -> Self {
        Self {
            anchor: 0.5,
            iterations: 20,
            direction: Direction::default(),
            boundary: Boundary::default(),
            preserve: Preserve::default(),
            max_displacement: None,
            max_memory: None,
        }
    }
}

/// A mesh with edited details.
#[derive(Clone, PartialEq, Debug)]
pub struct Detailed<T: Scalar> {
    /// The new positions, in the units of the input.
    pub positions: Positions<T>,
    /// The number of vertices that were kept in place because faces around them would have
    /// flipped.
    pub kept_vertices: usize,
}

/// Rebuilds a mesh from the mean curvatures requested by an edit.
///
/// Target field and areas are those of the input; normals are those of the current surface.
/// Slivers have the weights of [`MollifiedCotangent`], and the area of a vertex is at least a
/// twentieth of the largest area among its neighbours. Where an edit changes nothing, the mesh
/// stays exactly the same in `f64`. Vertices of faces that would flip against their neighbours
/// stay in place.
///
/// **Shapes**: one position per vertex. `handles` may hold or move additional vertices.
///
/// # Errors
/// [`Error`] for a mesh that is not a valid surface, handles that do not exist, a field of the
/// wrong length, and positions that diverge.
///
/// **Source**: paper, section 4.2; the anchors and the use of the input areas are ours.
pub fn edit_detail<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    handles: &Handles<T>,
    edit: &impl CurvatureEdit,
    options: &DetailOptions,
) -> Result<Positions<T>, Error> {
    let observer = |_| ControlFlow::Continue(());
    let edited = edit_detail_observed(surface, handles, edit, options, &observer)?;
    Ok(edited.positions)
}

/// Like [`edit_detail`], with an observer that receives the index of each completed iteration and
/// may stop the job.
///
/// # Errors
/// Same as [`edit_detail`], and [`Error::Cancelled`] if the observer stopped it.
pub fn edit_detail_observed<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    handles: &Handles<T>,
    edit: &impl CurvatureEdit,
    options: &DetailOptions,
    observer: &(dyn Fn(usize) -> ControlFlow<()> + Sync),
) -> Result<Detailed<T>, Error> {
    edit_part(surface.into(), handles, None, edit, options, observer)
}

/// Like [`edit_detail_observed`], for a part of the mesh.
///
/// # Errors
/// Same as [`edit_detail_observed`], and [`Error::FieldLength`] for a mask of another length.
pub fn edit_detail_masked<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    handles: &Handles<T>,
    mask: &Mask,
    edit: &impl CurvatureEdit,
    options: &DetailOptions,
    observer: &(dyn Fn(usize) -> ControlFlow<()> + Sync),
) -> Result<Detailed<T>, Error> {
    edit_part(surface.into(), handles, Some(mask), edit, options, observer)
}

fn edit_part<T: Scalar>(
    surface: Surface<'_, T>,
    handles: &Handles<T>,
    mask: Option<&Mask>,
    edit: &impl CurvatureEdit,
    options: &DetailOptions,
    observer: &(dyn Fn(usize) -> ControlFlow<()> + Sync),
) -> Result<Detailed<T>, Error> {
    let (mesh, positions) = (surface.mesh(), surface.positions());
    edit.check(mesh.num_vertices())?;
    let mut held = held(mesh, positions, options.boundary, handles)?;
    if let Some(mask) = mask {
        mask.check(mesh.num_vertices())?;
        mask.hold(&mut held);
    }
    let mask = mask.map(|mask| mask.shared(mesh));
    let mask = mask.as_deref();
    if options.iterations == 0 {
        return Ok(Detailed {
            positions: positions.clone(),
            kept_vertices: 0,
        });
    }
    let system = Anchored {
        mesh,
        rest: positions,
        data: positions,
        anchor: Some(options.anchor),
        boundary: options.boundary,
        handles,
        iterations: options.iterations,
        max_memory: options.max_memory,
        observer,
    };
    let direction = options.direction;
    let rest = system.rest(MollifiedCotangent::of(mesh))?;
    let updater = PrescribedField(wanted_field(&rest, edit, direction));
    let mut edited = system.run(rest, updater, AlongCurvature { direction })?;
    if let Some(mask) = mask {
        edited = mask.blend(positions, &edited);
    }
    let surface = Surface::new(mesh, positions)?;
    let size = surface.bounding_box().longest_side().as_f64();
    let bound = options.max_displacement.unwrap_or(LONGEST_MOVE * size);
    let correct = |edited: &Positions<T>, held: &[bool]| {
        let correction = Correction {
            mesh,
            original: positions,
            held,
            preserve: options.preserve,
            bound: Some(bound),
            mask,
        };
        correction.apply(edited)
    };
    let (positions, kept_vertices) = without_new_folds(&surface, edited, &held, correct)?;
    Ok(Detailed {
        positions,
        kept_vertices,
    })
}

/// Relative to the longest side of the bounding box.
const LONGEST_MOVE: f64 = 0.25;

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{bar, bumpy_plane, icosphere, torus};
    use cotan_geometry::{Mesh, folded_faces};
    use cotan_halfedge::HalfedgeMesh;
    use cotan_halfedge::VertexMap;
    use nalgebra::Point3;

    use super::*;
    use crate::smooth::{
        BandPass, Blend, ScaledCurvature, Sequence, Sum, TargetCurvature, TransferredCurvature,
        curvature_field, mean_curvature_rms, with_normal_noise,
    };

    fn edited(shape: &Mesh<f64>, edit: &impl CurvatureEdit) -> Positions<f64> {
        let options = DetailOptions::default();
        edit_detail(shape.surface(), &Handles::new(), edit, &options).unwrap()
    }

    fn rough() -> Mesh<f64> {
        let shape = torus::<f64>(1.0, 0.4, 40, 20);
        let noisy = with_normal_noise(&shape.surface(), 0.01, 9);
        shape.with_positions(noisy).unwrap()
    }

    fn farthest(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
        let pairs = a.values().zip(b.values());
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn edits_to_the_current_field_are_the_identity() {
        for shape in [rough(), bumpy_plane::<f64>([2.0, 2.0], [20, 20], 0.1)] {
            let same = ScaledCurvature::by(1.0);
            let surface = shape.surface();
            let mask: VertexMap<f64> = shape.positions().map(|p| 0.5 + 0.1 * p.x);
            let edits: [Box<dyn CurvatureEdit>; 7] = [
                Box::new(same),
                Box::new(BandPass::default()),
                Box::new(TransferredCurvature::from(&surface)),
                Box::new(TargetCurvature::new(&surface, &curvature_field(&surface))),
                Box::new(Sum(same, BandPass::default())),
                Box::new(Sequence(same, same)),
                Box::new(Blend {
                    mask,
                    off: same,
                    on: BandPass::default(),
                }),
            ];
            for (k, edit) in edits.iter().enumerate() {
                let off = farthest(&edited(&shape, edit), shape.positions());
                assert!(off < 1e-9, "edit {k}: {off:e}");
            }
        }
    }

    #[test]
    fn details_grow_and_fade_and_the_volume_stays() {
        let shape = rough();
        let surface = shape.surface();
        // The curvature of the smooth torus, which is subtracted below.
        let own = mean_curvature_rms(&torus::<f64>(1.0, 0.4, 40, 20).surface());
        let curved = |x: &Positions<f64>| mean_curvature_rms(&surface.with_positions(x)) - own;
        let [faded, doubled] = [0.0, 2.0].map(|f| edited(&shape, &ScaledCurvature::by(f)));
        let all = [curved(&faded), curved(shape.positions()), curved(&doubled)];
        assert!(all[0] < 0.5 * all[1], "{all:?}");
        assert!(all[2] > 1.3 * all[1], "{all:?}");
        for x in [&faded, &doubled] {
            let ratio = surface.with_positions(x).volume() / surface.volume();
            // The same as on the public models of the reference (1.013).
            assert!((ratio - 1.0).abs() < 0.015, "{ratio}");
        }
    }

    #[test]
    fn a_target_field_is_met() {
        let shape = icosphere::<f64>(4);
        let wanted = shape.positions().map(|p| 1.0 + 3.0 * (25.0 * p.z).sin());
        let x = edited(&shape, &TargetCurvature::new(&shape.surface(), &wanted));
        let now = curvature_field(&shape.surface().with_positions(&x));
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
        let result = edit_detail(large.surface(), &Handles::new(), &edit, &options);
        assert!(matches!(result, Err(Error::FieldLength { len: 42, .. })));
    }

    /// A bar in which one triangle has an additional vertex on a side, raised by `height`. The
    /// face that closes the gap to the neighbour has almost no area.
    fn bar_with_a_cap(height: f64) -> Mesh<f64> {
        let clean = bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
        let mut faces: Vec<[usize; 3]> = clean
            .connectivity()
            .faces()
            .map(|f| clean.connectivity().triangle(f).map(|v| v.index()))
            .collect();
        let mut positions: Vec<Point3<f64>> = clean.positions().values().copied().collect();
        let middle = faces.len() / 2;
        let [a, b, c] = faces[middle];
        let away = (positions[b] - positions[a]).cross(&(positions[c] - positions[a]));
        let m = positions[a] + (positions[b] - positions[a]) * 0.37 + away.normalize() * height;
        positions.push(m);
        let m = positions.len() - 1;
        faces[middle] = [a, m, c];
        faces.extend([[m, b, c], [a, b, m]]);
        let triangles: Vec<[u32; 3]> = faces.iter().map(|f| f.map(|v| v as u32)).collect();
        Mesh::new(
            HalfedgeMesh::from_faces(positions.len(), &triangles).expect("a surface"),
            Positions::from_vec(positions),
        )
        .unwrap()
    }

    /// A plate as exported by a CAD program: an ellipse whose rim is cut into a fan from one of
    /// its vertices, with angles up to 179.9 degrees, and the same on the underside.
    fn plate(n: u32) -> Mesh<f64> {
        let rim = |z: f64| {
            (0..n).map(move |k| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos();
                Point3::new(cos, 0.4 * sin, z)
            })
        };
        let positions: Positions<f64> = rim(0.0).chain(rim(0.2)).collect();
        let fan = (1..n - 1).flat_map(|k| [[0, k + 1, k], [n, n + k, n + k + 1]]);
        let wall = (0..n).flat_map(|a| {
            let b = (a + 1) % n;
            [[a, b, n + b], [a, n + b, n + a]]
        });
        let triangles: Vec<[u32; 3]> = fan.chain(wall).collect();
        Mesh::new(
            HalfedgeMesh::from_faces(2 * n as usize, &triangles).expect("a surface"),
            positions,
        )
        .unwrap()
    }

    fn all_edits(shape: &Mesh<f64>) -> Vec<Box<dyn CurvatureEdit>> {
        let surface = shape.surface();
        let mut edits: Vec<Box<dyn CurvatureEdit>> = Vec::new();
        for factor in [0.0, 1.5, 2.5] {
            edits.push(Box::new(ScaledCurvature::by(factor)));
        }
        edits.push(Box::new(BandPass {
            fine: 0.0,
            middle: 1.5,
            ..BandPass::default()
        }));
        edits.push(Box::new(TransferredCurvature::from(&surface)));
        edits.push(Box::new(TargetCurvature::new(
            &surface,
            &curvature_field(&surface).map(|h| h.clamp(-5.0, 5.0)),
        )));
        edits
    }

    #[test]
    fn a_face_without_area_changes_nothing_beyond_its_corners() {
        let clean = bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
        for height in [0.0, 1e-12, 1e-6] {
            let capped = bar_with_a_cap(height);
            for factor in [0.0, 1.5, 2.0] {
                let [x, y] = [&clean, &capped].map(|s| edited(s, &ScaledCurvature::by(factor)));
                let moved = |x: &Positions<f64>, s: &Mesh<f64>| farthest(x, s.positions());
                let (of_clean, of_capped) = (moved(&x, &clean), moved(&y, &capped));
                assert!(
                    (of_capped / of_clean - 1.0).abs() < 0.05,
                    "{height:e} {factor}: {of_clean} {of_capped}"
                );
                let surface = capped.surface();
                assert!(
                    folded_faces(&surface, &y)
                        .expect("positions that fit")
                        .is_empty()
                );
            }
        }
    }

    #[test]
    fn slivers_move_nothing_far_and_turn_no_face() {
        for shape in [
            bar_with_a_cap(0.0),
            bar_with_a_cap(1e-6),
            plate(128),
            plate(400),
        ] {
            for (k, edit) in all_edits(&shape).iter().enumerate() {
                let x = edited(&shape, edit);
                let moved = farthest(&x, shape.positions());
                let size = shape.surface().bounding_box().longest_side();
                assert!(moved < 0.1 * size, "edit {k}: {moved}");
                let folded = folded_faces(&shape.surface(), &x).expect("positions that fit");
                assert!(folded.is_empty(), "edit {k}: {folded:?}");
            }
        }
    }

    #[test]
    fn a_scale_of_one_changes_no_digit() {
        let odd = bumpy_plane::<f64>([2.0, 2.0], [20, 20], 0.1);
        for shape in [
            rough(),
            odd,
            bar_with_a_cap(0.0),
            bar_with_a_cap(1e-6),
            plate(128),
        ] {
            for preserve in [Preserve::Nothing, Preserve::Volume] {
                let options = DetailOptions {
                    preserve,
                    ..DetailOptions::default()
                };
                let edits: [Box<dyn CurvatureEdit>; 2] = [
                    Box::new(ScaledCurvature::by(1.0)),
                    Box::new(BandPass::default()),
                ];
                for edit in edits {
                    let none = Handles::new();
                    let x = edit_detail(shape.surface(), &none, &edit, &options);
                    assert_eq!(&x.expect("an edit"), shape.positions());
                }
            }
        }
    }
}
