//! The part of a surface that is kept, and the loops along which it was cut.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{FaceId, FaceMap, HalfedgeId, HalfedgeMesh, VertexId};

use super::error::{Input, MergeError};

/// A part of a surface: whole faces, without vertices at which only corners touch.
pub(super) struct Part {
    /// In ascending order.
    pub(super) faces: Vec<FaceId>,
    /// The vertices along each cut, in the direction in which the kept faces run.
    pub(super) loops: Vec<Vec<VertexId>>,
    /// Number of selected faces that were dropped: attached by a corner only, or in a small piece.
    pub(super) dropped: usize,
}

impl Part {
    /// Cuts a surface along the edges between faces that are kept and faces that are not.
    pub(super) fn cut<T: Scalar>(
        surface: &Surface<'_, T>,
        keep: &FaceMap<bool>,
        input: Input,
    ) -> Result<Self, MergeError> {
        let mesh = surface.mesh();
        if keep.len() != mesh.num_faces() {
            return Err(MergeError::KeepLength {
                input,
                len: keep.len(),
                num_faces: mesh.num_faces(),
            });
        }
        let mut is_kept = keep.clone();
        remove_pinches(mesh, &mut is_kept);
        remove_fragments(surface, &mut is_kept);
        let faces: Vec<FaceId> = mesh.faces().filter(|&f| is_kept[f]).collect();
        if faces.is_empty() {
            return Err(MergeError::NothingKept { input });
        }
        let loops = loops(mesh, &is_kept, input)?;
        if loops.is_empty() {
            return Err(MergeError::NothingCut { input });
        }
        let wanted = keep.values().filter(|&&keep| keep).count();
        Ok(Self {
            dropped: wanted - faces.len(),
            faces,
            loops,
        })
    }
}

/// Drops the faces around every vertex at which the kept faces form more than one fan, until there
/// is none.
fn remove_pinches(mesh: &HalfedgeMesh, is_kept: &mut FaceMap<bool>) {
    let mut open: Vec<VertexId> = mesh.vertices().collect();
    while !open.is_empty() {
        let mut next = Vec::new();
        for v in open {
            let fans = mesh
                .outgoing_halfedges(v)
                .filter(|&h| is_border(mesh, is_kept, h))
                .count();
            if fans < 2 {
                continue;
            }
            let around: Vec<FaceId> = mesh.vertex_faces(v).filter(|&f| is_kept[f]).collect();
            for f in around {
                is_kept[f] = false;
                next.extend(mesh.face_vertices(f));
            }
        }
        next.sort_unstable();
        next.dedup();
        open = next;
    }
}

/// Drops the pieces that are small next to the largest piece of the same component: a selection
/// by box or sphere often catches a few faces elsewhere.
fn remove_fragments<T: Scalar>(surface: &Surface<'_, T>, is_kept: &mut FaceMap<bool>) {
    let mesh = surface.mesh();
    let components = mesh.components();
    let mut piece = FaceMap::filled(mesh.num_faces(), usize::MAX);
    // Area and component of each piece.
    let mut pieces: Vec<(f64, usize)> = Vec::new();
    let areas = surface.face_areas();
    for first in mesh.faces() {
        if !is_kept[first] || piece[first] != usize::MAX {
            continue;
        }
        let of = components.of(mesh.origin(mesh.face_halfedge(first)));
        let (index, mut area) = (pieces.len(), 0.0);
        piece[first] = index;
        let mut stack = vec![first];
        while let Some(f) = stack.pop() {
            area += areas[f].as_f64();
            for h in mesh.face_halfedges(f) {
                if let Some(other) = mesh.face(h.twin())
                    && is_kept[other]
                    && piece[other] == usize::MAX
                {
                    piece[other] = index;
                    stack.push(other);
                }
            }
        }
        pieces.push((area, of));
    }
    let mut largest = vec![0.0_f64; components.count()];
    for &(area, of) in &pieces {
        largest[of] = largest[of].max(area);
    }
    for f in mesh.faces() {
        if let Some(&(area, of)) = pieces.get(piece[f]) {
            is_kept[f] = area >= SMALLEST_PIECE * largest[of];
        }
    }
}

/// A kept face on this side, and none on the other.
fn is_border(mesh: &HalfedgeMesh, is_kept: &FaceMap<bool>, h: HalfedgeId) -> bool {
    let kept = |h| mesh.face(h).is_some_and(|f| is_kept[f]);
    kept(h) && !kept(h.twin())
}

/// The loops of the border that are not boundary loops of the surface.
fn loops(
    mesh: &HalfedgeMesh,
    is_kept: &FaceMap<bool>,
    input: Input,
) -> Result<Vec<Vec<VertexId>>, MergeError> {
    let mut loops = Vec::new();
    let mut is_done = vec![false; mesh.num_vertices()];
    for v in mesh.vertices() {
        let Some(first) = border_from(mesh, is_kept, v).filter(|_| !is_done[v.index()]) else {
            continue;
        };
        let (mut vertices, mut cuts, mut h) = (Vec::new(), 0, first);
        loop {
            let from = mesh.origin(h);
            is_done[from.index()] = true;
            vertices.push(from);
            cuts += usize::from(mesh.face(h.twin()).is_some());
            // Without pinches each vertex of the border starts exactly one of its halfedges.
            match border_from(mesh, is_kept, mesh.target(h)) {
                Some(next) if next != first => h = next,
                _ => break,
            }
        }
        if cuts == vertices.len() {
            loops.push(vertices);
        } else if cuts > 0 {
            return Err(MergeError::CutMeetsRim { input, vertex: v });
        }
    }
    Ok(loops)
}

fn border_from(mesh: &HalfedgeMesh, is_kept: &FaceMap<bool>, v: VertexId) -> Option<HalfedgeId> {
    let mut outgoing = mesh.outgoing_halfedges(v);
    outgoing.find(|&h| is_border(mesh, is_kept, h))
}

/// Relative to the area of the largest piece of the same component.
const SMALLEST_PIECE: f64 = 0.05;

#[cfg(test)]
mod tests {
    use cotan_geometry::{Mesh, shapes};

    use super::*;

    fn upper(shape: &Mesh<f64>) -> FaceMap<bool> {
        let mesh = shape.connectivity();
        FaceMap::from_fn(mesh.num_faces(), |f| {
            mesh.face_vertices(f).all(|v| shape.positions()[v].z > 0.1)
        })
    }

    #[test]
    fn a_sphere_cut_once_has_one_loop_that_runs_with_its_faces() {
        let shape = shapes::icosphere::<f64>(3);
        let part = Part::cut(&shape.surface(), &upper(&shape), Input::A).unwrap();
        assert_eq!(part.loops.len(), 1);
        let vertices = &part.loops[0];
        let mesh = shape.connectivity();
        for (k, &v) in vertices.iter().enumerate() {
            let next = vertices[(k + 1) % vertices.len()];
            let h = mesh.halfedge_between(v, next).unwrap();
            assert!(part.faces.contains(&mesh.face(h).unwrap()));
            assert!(!part.faces.contains(&mesh.face(h.twin()).unwrap()));
        }
    }

    #[test]
    fn faces_that_touch_at_a_corner_or_lie_apart_are_dropped() {
        let shape = shapes::icosphere::<f64>(3);
        let mesh = shape.connectivity();
        let mut keep = upper(&shape);
        let whole = Part::cut(&shape.surface(), &keep, Input::A).unwrap();
        // One face far below.
        let lowest = mesh.faces().min_by(|a, b| {
            let z = |f| -> f64 { mesh.face_vertices(f).map(|v| shape.positions()[v].z).sum() };
            z(*a).total_cmp(&z(*b))
        });
        keep[lowest.unwrap()] = true;
        let part = Part::cut(&shape.surface(), &keep, Input::A).unwrap();
        assert_eq!(part.dropped, whole.dropped + 1);
        assert_eq!(part.faces, whole.faces);
        // Two triangles opposite each other at a vertex.
        let v = VertexId::new(0);
        let around: Vec<FaceId> = mesh.vertex_faces(v).collect();
        let mut keep = FaceMap::filled(mesh.num_faces(), false);
        for f in [around[0], around[2]] {
            keep[f] = true;
        }
        assert_eq!(
            Part::cut(&shape.surface(), &keep, Input::B).err(),
            Some(MergeError::NothingKept { input: Input::B })
        );
    }

    #[test]
    fn cuts_that_reach_a_rim_and_selections_that_cut_nothing_are_refused() {
        let plane = shapes::bumpy_plane::<f64>([1.0, 1.0], [8, 8], 0.0);
        let mesh = plane.connectivity();
        let half = FaceMap::from_fn(mesh.num_faces(), |f| {
            mesh.face_vertices(f).all(|v| plane.positions()[v].x < 0.1)
        });
        let error = Part::cut(&plane.surface(), &half, Input::A).err();
        assert!(
            matches!(error, Some(MergeError::CutMeetsRim { .. })),
            "{error:?}"
        );
        let all = FaceMap::filled(mesh.num_faces(), true);
        let error = Part::cut(&plane.surface(), &all, Input::A).err();
        assert_eq!(error, Some(MergeError::NothingCut { input: Input::A }));
    }
}
