//! Smoothing of free boundary loops.

use std::sync::Arc;

use cotan_geometry::Positions;
use cotan_halfedge::HalfedgeMesh;
use cotan_laplacian::{Graph, Operator, RowId, Symmetry};
use cotan_linear::{Bilaplacian, BilaplacianSystem, SystemOptions};
use nalgebra::Vector3;

use super::screen;
use crate::error::Error;

/// The displacements of all rows that smooth the boundary loops by the same filter as the
/// surface, in one dimension:
///
/// ```text
/// u = −B² x⁰        B = (S m⁻¹ S + μ² m)⁻¹ S m⁻¹ S        S_ij = −1/|e_ij|, m = half the edges
/// ```
///
/// Loops shorter than eight sizes stay, because the filter would shrink them, and so do vertices
/// at which pieces of the mesh meet.
pub(super) fn smoothed_rims(
    mesh: &HalfedgeMesh,
    positions: &Positions<f64>,
    sizes: &[f64],
) -> Result<Vec<Vector3<f64>>, Error> {
    let mut moves = vec![Vector3::zeros(); mesh.num_rows()];
    for start in mesh.boundary_loops() {
        let vertices = mesh
            .boundary_loop(start)
            .map(|h| mesh.row_of(mesh.origin(h)));
        let vertices: Vec<_> = vertices.collect();
        let points: Vec<_> = vertices.iter().map(|v| positions[*v].coords).collect();
        let sizes: Vec<_> = vertices.iter().map(|v| sizes[v.index()]).collect();
        let Some(filtered) = filtered(&points, &sizes)? else {
            continue;
        };
        for (v, u) in vertices.iter().zip(filtered) {
            if !mesh.is_shared_vertex(*v) {
                moves[v.index()] = u;
            }
        }
    }
    Ok(moves)
}

/// The displacements of the corners of a closed polygon; `None` if it is too short.
fn filtered(points: &[Vector3<f64>], sizes: &[f64]) -> Result<Option<Vec<Vector3<f64>>>, Error> {
    let n = points.len();
    let lengths: Vec<f64> = (0..n)
        .map(|i| (points[(i + 1) % n] - points[i]).norm())
        .collect();
    let perimeter: f64 = lengths.iter().sum();
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    if n < 4 || !(perimeter > 0.0 && perimeter >= SHORTEST * largest) {
        return Ok(None);
    }
    let least = MIN_LENGTH * perimeter / n as f64;
    let lengths: Vec<f64> = lengths.iter().map(|l| l.max(least)).collect();
    let pairs: Vec<[RowId; 2]> = (0..n).map(|i| [i, (i + 1) % n].map(RowId::new)).collect();
    let graph = Arc::new(Graph::from_pairs(n, &pairs));
    let weight = |i: usize, j: usize| match (i + 1) % n == j {
        true => 1.0 / lengths[i],
        false => 1.0 / lengths[j],
    };
    let weights = (0..n).flat_map(|i| graph.row(i).map(move |(j, _)| (i, j.index())));
    let weights = weights.map(|(i, j)| weight(i, j)).collect();
    let Ok(operator) = Operator::<f64>::new(graph.clone(), weights, Symmetry::Symmetric) else {
        return Ok(None);
    };
    let masses: Vec<f64> = (0..n)
        .map(|i| 0.5 * (lengths[i] + lengths[(i + n - 1) % n]))
        .collect();
    let pairs = masses.iter().zip(sizes);
    let diagonal: Vec<f64> = pairs.map(|(m, s)| screen(*s).powi(2) * m).collect();
    let equation = Bilaplacian {
        operator: &operator,
        masses: &masses,
        without_row: &vec![false; n],
        diagonal: &diagonal,
        fixed: &[],
    };
    let system = BilaplacianSystem::prepare(&equation, SystemOptions::new())?;
    let bends = |x: &[Vector3<f64>]| -> Result<Vec<Vector3<f64>>, Error> {
        let (mut between, mut rhs) = (vec![Vector3::zeros(); n], vec![Vector3::zeros(); n]);
        system.laplacian(x, &mut between);
        system.right_hand_side(&between, &mut rhs);
        let mut bends = vec![Vector3::zeros(); n];
        system.solve(&rhs, &mut bends, 1e-8)?;
        Ok(bends)
    };
    let twice = bends(&bends(points)?)?;
    Ok(Some(twice.into_iter().map(|u| -u).collect()))
}

/// In sizes: a circle of this perimeter is scaled by 1 − 9e-5.
const SHORTEST: f64 = 8.0;

/// Relative to the mean edge.
const MIN_LENGTH: f64 = 1e-6;
