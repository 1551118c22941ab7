//! Elements in an order in which neighbours are close together in memory.
//!
//! Splits append their vertices and triangles at the end, in the order of their lengths. After a
//! few rounds every access to a neighbour misses the cache.

use super::{NONE, Triangles};

impl Triangles {
    /// Sorts the vertices breadth first, the triangles by their first vertices, and drops removed
    /// ones. Returns the old index of every vertex.
    pub(crate) fn reorder(&mut self) -> Vec<u32> {
        let old_vertex = self.breadth_first();
        let new_vertex = inverse(&old_vertex, self.points.len());

        let mut keys = cotan_parallel::filter_map(self.origin.len() / 3, |f| {
            let f = f as u32;
            self.is_alive(3 * f).then(|| {
                let [a, b, c] = self.corners(f).map(|v| new_vertex[v as usize]);
                (a.min(b).min(c), f)
            })
        });
        cotan_parallel::sort_unstable(&mut keys);
        let old_face: Vec<u32> = keys.into_iter().map(|(_, f)| f).collect();
        let new_face = inverse(&old_face, self.origin.len() / 3);

        let new_halfedge = |h: u32| {
            if h == NONE {
                NONE
            } else {
                3 * new_face[h as usize / 3] + h % 3
            }
        };
        let old_halfedge = |i: usize| (3 * old_face[i / 3]) as usize + i % 3;
        let count = 3 * old_face.len();
        let reordered = Self {
            origin: cotan_parallel::filled(count, |i| {
                new_vertex[self.origin[old_halfedge(i)] as usize]
            }),
            twin: cotan_parallel::filled(count, |i| new_halfedge(self.twin[old_halfedge(i)])),
            tag: cotan_parallel::filled(count, |i| self.tag[old_halfedge(i)]),
            outgoing: cotan_parallel::filled(old_vertex.len(), |v| {
                new_halfedge(self.outgoing[old_vertex[v] as usize])
            }),
            points: permuted(&self.points, &old_vertex),
            num_faces: self.num_faces,
            seen: vec![0; old_vertex.len()],
            search: 0,
        };
        *self = reordered;
        old_vertex
    }

    /// The vertices, each followed by those of its neighbours that had not been met.
    fn breadth_first(&self) -> Vec<u32> {
        let mut is_met = vec![false; self.points.len()];
        let mut order = Vec::with_capacity(self.points.len());
        let mut done = 0;
        for start in 0..self.points.len() as u32 {
            if !self.has_vertex(start) || std::mem::replace(&mut is_met[start as usize], true) {
                continue;
            }
            order.push(start);
            while let Some(&v) = order.get(done) {
                done += 1;
                for w in self.neighbors(v) {
                    if !std::mem::replace(&mut is_met[w as usize], true) {
                        order.push(w);
                    }
                }
            }
        }
        order
    }
}

/// The values of the old elements in the new order.
pub(crate) fn permuted<A: Copy + Send + Sync>(values: &[A], old: &[u32]) -> Vec<A> {
    cotan_parallel::filled(old.len(), |i| values[old[i] as usize])
}

/// Per old element: its new index, or [`NONE`].
fn inverse(old: &[u32], num_old: usize) -> Vec<u32> {
    let mut new = vec![NONE; num_old];
    for (i, &old) in old.iter().enumerate() {
        new[old as usize] = i as u32;
    }
    new
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn elements_in_another_order_are_the_same_surface() {
        let mesh = cotan_geometry::torus::<f64>(0.6, 0.2, 12, 7);
        let mut triangles = Triangles::new(&mesh.surface()).unwrap();
        triangles.split(5, Vector3::new(0.1, 0.2, 0.3));
        let edge = (0..).find(|&h| triangles.is_edge(h) && triangles.can_collapse(h));
        triangles.collapse(edge.unwrap());
        let before = triangles.clone();
        let old = triangles.reorder();
        triangles.check();
        assert_eq!(triangles.num_faces * 3, triangles.origin.len());
        let surface = |t: &Triangles, name: &dyn Fn(u32) -> u32| {
            let mut faces: Vec<_> = (0..(t.origin.len() / 3) as u32)
                .filter(|&f| t.is_alive(3 * f))
                .map(|f| t.corners(f).map(name))
                .collect();
            faces.sort_unstable();
            faces
        };
        let [a, b] = [
            surface(&before, &|v| v),
            surface(&triangles, &|v| old[v as usize]),
        ];
        assert_eq!(a, b);
        assert_eq!(triangles.points, permuted(&before.points, &old));
    }
}
