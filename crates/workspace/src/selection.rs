//! Selections of vertices: sorted lists without duplicates.

use cotan::geometry::Surface;
use cotan::halfedge::{HalfedgeMesh, VertexId};
use cotan::surface::distances_within;
use serde::{Deserialize, Serialize};

/// The way in which found vertices are combined with the selection.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Combine {
    /// They become the selection.
    Replace,
    /// They are added to it.
    Add,
    /// They are removed from it.
    Subtract,
}

/// Combines the selection with found vertices, in any order.
pub fn combined(selection: &[VertexId], found: &[VertexId], how: Combine) -> Vec<VertexId> {
    let mut found = found.to_vec();
    found.sort_unstable();
    found.dedup();
    match how {
        Combine::Replace => found,
        Combine::Add => {
            found.extend(selection);
            found.sort_unstable();
            found.dedup();
            found
        }
        Combine::Subtract => {
            let is_kept = |v: &&VertexId| found.binary_search(v).is_err();
            selection.iter().filter(is_kept).copied().collect()
        }
    }
}

/// The vertices that are not in `selection`.
pub fn inverted(mesh: &HalfedgeMesh, selection: &[VertexId]) -> Vec<VertexId> {
    let is_in = flags(mesh, selection);
    mesh.vertices().filter(|v| !is_in[v.index()]).collect()
}

/// The selection and its neighbours.
pub fn grown(mesh: &HalfedgeMesh, selection: &[VertexId]) -> Vec<VertexId> {
    let is_in = flags(mesh, selection);
    let is_near = |v: &VertexId| is_in[v.index()] || mesh.one_ring(*v).any(|w| is_in[w.index()]);
    mesh.vertices().filter(is_near).collect()
}

/// The vertices of the selection all of whose neighbours are in it.
pub fn shrunk(mesh: &HalfedgeMesh, selection: &[VertexId]) -> Vec<VertexId> {
    let is_in = flags(mesh, selection);
    // A vertex with copies is at the border if one of them is.
    let mut is_border = vec![false; mesh.num_vertices()];
    for v in selection {
        let is_inner = mesh.one_ring(*v).all(|w| is_in[w.index()]);
        is_border[mesh.row_of(*v).index()] |= !is_inner;
    }
    let is_kept = |v: &&VertexId| !is_border[mesh.row_of(**v).index()];
    selection.iter().filter(is_kept).copied().collect()
}

/// All vertices of the connected parts that the selection touches.
pub fn linked(mesh: &HalfedgeMesh, selection: &[VertexId]) -> Vec<VertexId> {
    let components = mesh.components();
    let mut is_touched = vec![false; components.count()];
    for &v in selection {
        is_touched[components.of(v)] = true;
    }
    let all = mesh.vertices();
    all.filter(|&v| is_touched[components.of(v)]).collect()
}

/// The vertices within a distance of the selection along the surface.
pub fn within(surface: &Surface<'_, f64>, selection: &[VertexId], far: f64) -> Vec<VertexId> {
    let near = distances_within(*surface, selection, far);
    near.iter()
        .filter(|(_, d)| **d <= far)
        .map(|(v, _)| v)
        .collect()
}

fn flags(mesh: &HalfedgeMesh, selection: &[VertexId]) -> Vec<bool> {
    let mut is_in = vec![false; mesh.num_vertices()];
    for v in selection {
        is_in[v.index()] = true;
    }
    is_in
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growing_and_shrinking_undo_each_other_inside_and_parts_are_linked() {
        let shape = cotan::shapes::icosphere::<f64>(3);
        let mesh = shape.connectivity();
        let seed = [VertexId::new(5)];
        let ring = grown(mesh, &seed);
        assert_eq!(ring.len(), 1 + mesh.one_ring(seed[0]).count());
        assert_eq!(shrunk(mesh, &ring), seed);
        assert_eq!(inverted(mesh, &inverted(mesh, &ring)), ring);
        assert_eq!(linked(mesh, &seed).len(), mesh.num_vertices());
        let near = within(&shape.surface(), &seed, 0.5);
        let at = shape.positions();
        // A distance along the surface is at least the straight one.
        assert!(near.iter().all(|&v| (at[v] - at[seed[0]]).norm() <= 0.5));
        assert!(near.len() > ring.len());
        let all = [4, 1, 4].map(VertexId::new);
        let both = combined(&seed, &all, Combine::Add);
        assert_eq!(both, [1, 4, 5].map(VertexId::new));
        assert_eq!(combined(&both, &all, Combine::Subtract), seed);
    }
}
