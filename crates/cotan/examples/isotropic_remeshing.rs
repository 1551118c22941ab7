//! A method from a paper with the edits of the half-edge mesh: isotropic remeshing. Attributes are
//! kept up to date: a colour per vertex and a label per face.
//!
//! `cotan::surface::remesh` does this for you, with features, borders and the original shape kept.
//!
//! Source: M. Botsch, L. Kobbelt, "A remeshing approach to multiresolution modeling", SGP 2004,
//! section 4: split long edges, collapse short ones, flip towards valence 6, relax tangentially.
//! The projection back onto the original surface is omitted, and edges between two labels are
//! never flipped, which preserves the border between them.
//!
//! `cargo run -p cotan --example isotropic_remeshing`

use cotan::prelude::*;
use cotan::shapes::{VertexOrder, irregular};

/// The target edge length. Edges longer by a third are split, edges shorter by a fifth are
/// collapsed.
const LENGTH: f64 = 0.1;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut mesh, mut x) = irregular::<f64>(1000, VertexOrder::Random, 1).into_parts();
    // A colour that encodes the position, and a label for each side.
    let mut color = x.map(|p| p.coords);
    let mut label = FaceMap::from_fn(mesh.num_faces(), |f| x[mesh.triangle(f)[0]].x > 0.0);
    let regular = |m: &HalfedgeMesh| m.vertices().filter(|&v| m.valence(v) == 6).count();
    let mean = Surface::new(&mesh, &x)?.mean_edge_length();
    println!("before: edges of {mean:.3}, {} regular", regular(&mesh));
    for _ in 0..10 {
        for e in mesh.edges() {
            let [a, b] = mesh.edge_vertices(e);
            if (x[a] - x[b]).norm() > 4.0 / 3.0 * LENGTH {
                mesh.split_edge(e)?.apply_faces(&mut label)?;
                x.push(x[a].lerp(&x[b], 0.5));
                color.push(color[a].lerp(&color[b], 0.5));
            }
        }
        for h in mesh.halfedges().rev() {
            // Also rejects ids that no longer exist.
            if mesh.can_collapse(h).is_ok() {
                let [a, b] = [mesh.origin(h), mesh.target(h)];
                let is_far = |v| (x[v] - x[b]).norm() > 4.0 / 3.0 * LENGTH;
                if (x[a] - x[b]).norm() < 0.8 * LENGTH && !mesh.one_ring(a).any(is_far) {
                    let renumbering = mesh.collapse(h)?.renumbering;
                    renumbering.apply_vertices(&mut x)?;
                    renumbering.apply_vertices(&mut color)?;
                    renumbering.apply_faces(&mut label)?;
                }
            }
        }
        for e in mesh.edges() {
            let sides = e.halfedges().map(|h| mesh.face(h).map(|f| label[f]));
            let inside = sides[0] == sides[1];
            if inside && let Ok(flip) = mesh.flip_edge(e) {
                // The flip takes an edge from the old ends and gives one to the new ends.
                let off = |v: VertexId, regular| mesh.valence(v).abs_diff(regular) as i32;
                let gain: i32 = flip.old_ends.map(|v| off(v, 5) - off(v, 6)).iter().sum();
                let loss: i32 = flip.new_ends.map(|v| off(v, 6) - off(v, 7)).iter().sum();
                if gain <= loss {
                    mesh.flip_edge(e)?;
                }
            }
        }
        // Halfway to the mean of six neighbours, along the surface.
        for (v, n) in &Surface::new(&mesh, &x)?.vertex_normals() {
            for w in mesh.one_ring(v) {
                let step = (x[w] - x[v]) / 12.0;
                x[v] += step - n * n.dot(&step);
                color[v] = color[v].lerp(&color[w], 1.0 / 12.0);
            }
        }
    }
    let mean = Surface::new(&mesh, &x)?.mean_edge_length();
    println!("after: edges of {mean:.3}, {} regular", regular(&mesh));
    assert!((mean / LENGTH - 1.0).abs() < 0.1 && 3 * regular(&mesh) > 2 * x.len());
    // Both attributes still match the positions.
    assert!((color.iter()).all(|(v, c)| (c - x[v].coords).norm() < LENGTH));
    let place = |f| x[mesh.triangle(f)[0]].x;
    assert!((label.iter()).all(|(f, l)| *l == (place(f) > 0.0) || place(f).abs() < 2.0 * LENGTH));
    Ok(())
}
