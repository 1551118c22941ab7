//! Heights that become displacements, with damping where the surface would fold.

use cotan_geometry::{Positions, Scalar, Surface, folded_faces};
use cotan_halfedge::{FaceId, FaceMap, HalfedgeMesh, VertexId, VertexMap};
use nalgebra::Vector3;

use super::base::BaseSurface;
use super::error::DetailError;
use super::heights::Detail;
use super::options::ApplyOptions;
use crate::error::Error;
use crate::smooth::{Boundary, Correction, Mask, check_bound};

/// A surface with the details of another.
#[derive(Clone, PartialEq, Debug)]
pub struct Applied<T: Scalar> {
    /// The new positions, in the units of the mesh.
    pub positions: Positions<T>,
    /// The share of the heights that was kept: the ratio of their root mean squares after and
    /// before damping. 1 without any heights.
    pub kept: f64,
    /// The number of rounds of damping.
    pub rounds: usize,
    /// The number of vertices whose height was damped.
    pub damped_vertices: usize,
}

impl Detail {
    /// Moves the vertices of a surface by these heights along the normals of its base:
    /// x' = x + s h n̄. The details that it has already stay.
    ///
    /// If a face would turn by more than 78° or fold over its neighbours, the heights around it
    /// are reduced, round by round, until no such face is left. Vertices of height 0 keep their
    /// exact positions, and so do those at which several pieces of a mesh meet.
    ///
    /// # Errors
    /// [`DetailError::Mesh`] if there is not one height per vertex, and for a mask of another
    /// length, a scale that is not finite, a bound that is not positive, and a volume or area that
    /// cannot be preserved.
    pub fn apply<T: Scalar>(
        &self,
        target: &BaseSurface<T>,
        options: &ApplyOptions,
    ) -> Result<Applied<T>, DetailError> {
        let surface = target.surface();
        let mesh = surface.mesh();
        check_bound(options.max_displacement)?;
        if !options.scale.is_finite() {
            return Err(crate::smooth::refuse("scale", "finite", options.scale).into());
        }
        let whole = self.clone().scaled(options.scale);
        let mut whole = Self::with_heights(target, whole.heights().clone())?;
        if let Some(mask) = &options.mask {
            whole = whole.masked(mask)?;
        }
        if let Some(mask) = still_border(target, options.boundary)? {
            whole = whole.masked(&mask)?;
        }
        let mut heights = whole.heights().clone();
        let held = held(mesh, options);
        let correction = Correction {
            mesh,
            original: surface.positions(),
            held: &held,
            preserve: options.preserve,
            bound: options.max_displacement,
            mask: options.mask.as_ref(),
        };
        let before = face_normals(&surface);
        let mut rounds = 0;
        let positions = loop {
            let moved = correction.apply(&moved(target, &heights))?;
            let bad = bad_faces(&surface, &moved, &before, &heights)?;
            if bad.is_empty() {
                break moved;
            }
            rounds += 1;
            damp(mesh, &bad, rounds, &mut heights);
        };
        let square = |h: &VertexMap<f64>| -> f64 {
            let rows = mesh
                .rows()
                .map(|v| target.masses()[v.index()] * h[v] * h[v]);
            rows.sum()
        };
        let (left, all) = (square(&heights), square(whole.heights()));
        let pairs = heights.values().zip(whole.heights().values());
        Ok(Applied {
            positions,
            kept: if all > 0.0 { (left / all).sqrt() } else { 1.0 },
            rounds,
            damped_vertices: pairs.filter(|(now, before)| now != before).count(),
        })
    }
}

/// The moved positions. Moves below the rounding error of the filter are none.
fn moved<T: Scalar>(target: &BaseSurface<T>, heights: &VertexMap<f64>) -> Positions<T> {
    let unit = target.unit();
    let surface = target.surface();
    let moved = surface.positions().iter().map(|(v, p)| {
        let height = heights[v];
        match height.abs() > MIN_HEIGHT {
            true => (p.map(T::as_f64) + target.normals()[v] * (height * unit)).map(T::of_f64),
            false => *p,
        }
    });
    moved.collect()
}

/// Rows that no correction of volume or area may move.
fn held(mesh: &HalfedgeMesh, options: &ApplyOptions) -> Vec<bool> {
    let is_still = |v| match options.boundary {
        Boundary::Fixed => !mesh.is_inner_vertex(v),
        Boundary::Free => mesh.is_shared_vertex(v),
    };
    let mut held: Vec<bool> = mesh.rows().map(is_still).collect();
    if let Some(mask) = &options.mask {
        mask.shared(mesh).hold(&mut held);
    }
    held
}

/// Weights that fall to 0 towards the vertices that stay in place.
fn still_border<T: Scalar>(
    target: &BaseSurface<T>,
    boundary: Boundary,
) -> Result<Option<Mask>, Error> {
    let base = target.base();
    let mesh = base.mesh();
    let may_move = |v: &VertexId| match boundary {
        Boundary::Fixed => mesh.is_inner_vertex(*v),
        Boundary::Free => !mesh.is_shared_vertex(*v),
    };
    let moving: Vec<VertexId> = mesh.vertices().filter(may_move).collect();
    match moving.len() == mesh.num_vertices() {
        true => Ok(None),
        false => {
            let falloff = 0.5 * target.share() * target.unit();
            Mask::inside(&base, &moving, falloff).map(Some)
        }
    }
}

fn face_normals<T: Scalar>(surface: &Surface<'_, T>) -> FaceMap<Vector3<f64>> {
    surface.face_normals().map(|n| n.map(T::as_f64))
}

/// The faces that turned too far or face away from their neighbours, with these neighbours, of
/// those that have a height.
fn bad_faces<T: Scalar>(
    surface: &Surface<'_, T>,
    moved: &Positions<T>,
    before: &FaceMap<Vector3<f64>>,
    heights: &VertexMap<f64>,
) -> Result<Vec<FaceId>, Error> {
    let mesh = surface.mesh();
    let after = face_normals(&surface.with_positions(moved));
    // A face without area has no normal, before or after.
    let has_turned = |f: &FaceId| {
        let has_area = before[*f] != Vector3::zeros();
        has_area && !(before[*f].dot(&after[*f]) >= MIN_COSINE)
    };
    let mut bad: Vec<FaceId> = mesh.faces().filter(has_turned).collect();
    for f in folded_faces(surface, moved)? {
        bad.push(f);
        bad.extend(mesh.face_halfedges(f).filter_map(|h| mesh.face(h.twin())));
    }
    bad.retain(|f| mesh.triangle(*f).iter().any(|v| heights[*v] != 0.0));
    Ok(bad)
}

/// Reduces the heights at the corners of faces, and less at the two rings around them. After
/// [`ROUNDS`] rounds the corners get the height 0, so that there is an end.
fn damp(mesh: &HalfedgeMesh, faces: &[FaceId], round: usize, heights: &mut VertexMap<f64>) {
    let mut near: VertexMap<f64> = VertexMap::filled(mesh.num_vertices(), 0.0);
    let mut front: Vec<VertexId> = faces.iter().flat_map(|&f| mesh.triangle(f)).collect();
    for share in [1.0, 2.0 / 3.0, 1.0 / 3.0] {
        front.sort_unstable();
        front.dedup();
        front.retain(|v| near[*v] == 0.0);
        front.iter().for_each(|v| near[*v] = share);
        front = front.iter().flat_map(|v| mesh.one_ring(*v)).collect();
    }
    for (v, share) in near.iter() {
        if round > ROUNDS && *share == 1.0 {
            heights[v] = 0.0;
        } else {
            heights[v] *= 1.0 - DAMPING * share;
        }
    }
}

/// The part of a height that a round takes away.
const DAMPING: f64 = 0.3;

/// After this many rounds 0.2 % of a height are left.
const ROUNDS: usize = 18;

/// Of the angle by which a face may turn: 78°.
const MIN_COSINE: f64 = 0.2;

/// In square roots of the area: the rounding error of the filter.
const MIN_HEIGHT: f64 = 1e-13;
