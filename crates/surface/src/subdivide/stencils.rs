//! Sparse weights: every new value is a weighted sum of old ones.

use cotan_geometry::Scalar;
use cotan_halfedge::HalfedgeMesh;
use nalgebra::Vector3;

use super::InParent;

/// Weighted sums, one after another.
#[derive(Clone, PartialEq, Debug)]
pub struct Stencils {
    starts: Vec<usize>,
    entries: Vec<(u32, f64)>,
}

impl Default for Stencils {
    fn default() -> Self {
        Self {
            starts: vec![0],
            entries: Vec::new(),
        }
    }
}

impl Stencils {
    /// The number of sums.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns true if there are no sums.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The indices and weights of sum `i`. The weights sum to 1.
    pub fn terms(&self, i: usize) -> &[(u32, f64)] {
        &self.entries[self.starts[i]..self.starts[i + 1]]
    }

    /// The sums of `values`.
    ///
    /// # Panics
    /// If an index of a term is out of range.
    pub fn apply<T: Scalar>(&self, values: &[T]) -> Vec<T> {
        cotan_parallel::filled(self.len(), |i| {
            let terms = self.terms(i);
            match terms {
                [(j, _)] => values[*j as usize],
                _ => T::of_f64(
                    terms
                        .iter()
                        .map(|&(j, w)| w * values[j as usize].as_f64())
                        .sum(),
                ),
            }
        })
    }

    pub(super) fn apply_vectors<T: Scalar>(&self, values: &[Vector3<T>]) -> Vec<Vector3<T>> {
        cotan_parallel::filled(self.len(), |i| {
            let terms = self.terms(i);
            match terms {
                [(j, _)] => values[*j as usize],
                _ => {
                    let term = |&(j, w): &(u32, f64)| values[j as usize].map(T::as_f64) * w;
                    terms.iter().map(term).sum::<Vector3<f64>>().map(T::of_f64)
                }
            }
        })
    }

    pub(super) fn push(&mut self, terms: impl IntoIterator<Item = (usize, f64)>) {
        self.entries
            .extend(terms.into_iter().map(|(j, w)| (j as u32, w)));
        self.starts.push(self.entries.len());
    }

    /// Every corner of a face is itself.
    pub(super) fn identity_of_faces(mesh: &HalfedgeMesh) -> Self {
        let mut stencils = Self::default();
        for f in mesh.faces() {
            for k in 0..mesh.degree(f) {
                stencils.push([(k, 1.0)]);
            }
        }
        stencils
    }

    /// The weights of new corners, given those of the corners of `mesh`.
    pub(super) fn refined(
        &self,
        mesh: &HalfedgeMesh,
        corners: &[(cotan_halfedge::FaceId, InParent)],
    ) -> Self {
        let mut first = Vec::with_capacity(mesh.num_faces());
        let mut count = 0;
        for f in mesh.faces() {
            first.push(count);
            count += mesh.degree(f);
        }
        let mut refined = Self::default();
        for &(face, place) in corners {
            let degree = mesh.degree(face);
            let of = |k: usize| self.terms(first[face.index()] + k);
            let mean = |ks: &[usize]| {
                let weight = 1.0 / ks.len() as f64;
                let mut sum: Vec<(usize, f64)> = Vec::new();
                for &(j, w) in ks.iter().flat_map(|&k| of(k)) {
                    match sum.iter_mut().find(|(i, _)| *i == j as usize) {
                        Some((_, total)) => *total += w * weight,
                        None => sum.push((j as usize, w * weight)),
                    }
                }
                sum
            };
            refined.push(match place {
                InParent::Corner(k) => mean(&[k]),
                InParent::Edge(k) => mean(&[k, (k + 1) % degree]),
                InParent::Center => mean(&(0..degree).collect::<Vec<_>>()),
            });
        }
        refined
    }
}
