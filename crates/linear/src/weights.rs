//! The weights in ring order, products with them, and the forms that a factorization can use.

use std::collections::VecDeque;

use cotan_geometry::Scalar;
use cotan_laplacian::{Graph, Operator, Symmetry};
use nalgebra::Vector3;

/// The weights in ring order, and products with L and Lᵀ in difference form.
pub(crate) struct Weights {
    /// w_ij for every neighbour j of every i, in the order of the graph.
    outgoing: Vec<f64>,
    /// w_ji in the same order; empty if the scheme is symmetric.
    incoming: Vec<f64>,
    form: Form,
}

/// The symmetry of the weights: L = −D⁻¹W with a symmetric W.
pub(crate) enum Form {
    /// D = 1.
    Symmetric,
    /// D, one positive number per vertex: row-normalised weights, such as Tutte's.
    RowScaled(Vec<f64>),
    /// There is no such D.
    General,
}

impl Weights {
    pub(crate) fn new<T: Scalar>(operator: &Operator<T>) -> Self {
        let graph = operator.graph();
        let outgoing = operator.weights().to_vec();
        if operator.symmetry() == Symmetry::Symmetric {
            return Self {
                outgoing,
                incoming: Vec::new(),
                form: Form::Symmetric,
            };
        }
        let reverse = graph.reverse().iter();
        let incoming: Vec<f64> = reverse.map(|&k| outgoing[k as usize]).collect();
        let tolerance = 1e3 * T::default_epsilon().as_f64();
        let form = row_scale(graph, &outgoing, &incoming, tolerance)
            .map_or(Form::General, Form::RowScaled);
        Self {
            outgoing,
            incoming,
            form,
        }
    }

    pub(crate) fn form(&self) -> &Form {
        &self.form
    }

    /// w_ij of ring entry number `k`.
    pub(crate) fn outgoing(&self, k: usize) -> f64 {
        self.outgoing[k]
    }

    /// Weight of the same edge in the other direction.
    pub(crate) fn incoming(&self, k: usize) -> f64 {
        if self.incoming.is_empty() {
            self.outgoing[k]
        } else {
            self.incoming[k]
        }
    }

    /// W_ij of ring entry number `k` at vertex `i`: the same from both ends, to the last bit.
    pub(crate) fn symmetric(&self, graph: &Graph, i: usize, k: usize) -> f64 {
        match &self.form {
            Form::RowScaled(scale) => {
                let j = graph.neighbours()[k].index();
                0.5 * (scale[i] * self.outgoing[k] + scale[j] * self.incoming[k])
            }
            Form::Symmetric | Form::General => self.outgoing[k],
        }
    }

    /// (Lᵀ y)_i = Σ_j (w_ji y_j − w_ij y_i), with L the operator as the paper signs it.
    pub(crate) fn transpose_product(
        &self,
        graph: &Graph,
        i: usize,
        y: &[Vector3<f64>],
    ) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for k in graph.range(i) {
            let j = graph.neighbours()[k].index();
            sum += y[j] * self.incoming(k) - y[i] * self.outgoing(k);
        }
        sum
    }

    /// Row i of L with its diagonal: pairs (column, entry), diagonal first.
    pub(crate) fn row<'a>(
        &'a self,
        graph: &'a Graph,
        i: usize,
    ) -> impl Iterator<Item = (usize, f64)> + 'a {
        let range = graph.range(i);
        let diagonal = -self.outgoing[range.clone()].iter().sum::<f64>();
        std::iter::once((i, diagonal))
            .chain(range.map(|k| (graph.neighbours()[k].index(), self.outgoing[k])))
    }
}

/// D with D_i w_ij = D_j w_ji for every edge within `tolerance`, if there is one: spread from the
/// first vertex of every component and then checked (Kolmogorov's criterion for a reversible
/// chain).
fn row_scale(
    graph: &Graph,
    outgoing: &[f64],
    incoming: &[f64],
    tolerance: f64,
) -> Option<Vec<f64>> {
    let n = graph.num_rows();
    let mut scale = vec![0.0; n];
    let mut queue = VecDeque::new();
    for start in 0..n {
        if scale[start] != 0.0 {
            continue;
        }
        scale[start] = 1.0;
        queue.push_back(start);
        // In breadth, so that few roundings add up on the way to a vertex.
        while let Some(i) = queue.pop_front() {
            for k in graph.range(i) {
                let j = graph.neighbours()[k].index();
                let next = scale[i] * outgoing[k] / incoming[k];
                if scale[j] == 0.0 && next.is_normal() && next > 0.0 {
                    scale[j] = next;
                    queue.push_back(j);
                }
            }
        }
    }
    let agrees = |i: usize| {
        graph.range(i).all(|k| {
            let j = graph.neighbours()[k].index();
            let (there, back) = (scale[i] * outgoing[k], scale[j] * incoming[k]);
            (there - back).abs() <= tolerance * there.abs().max(back.abs())
        })
    };
    (0..n).all(agrees).then_some(scale)
}

#[cfg(test)]
mod tests {
    use cotan_geometry::testing::surfaces;
    use cotan_laplacian::Tutte;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_row_scale_of_tutte_is_the_valence(shape in surfaces()) {
            let operator = Operator::assemble(&Tutte, &shape.surface())?;
            let weights = Weights::new(&operator);
            let Form::RowScaled(scale) = weights.form() else { panic!("not found") };
            let graph = operator.graph();
            let ratio = scale[0] / graph.range(0).len() as f64;
            for (i, d) in scale.iter().enumerate() {
                prop_assert!((d - ratio * graph.range(i).len() as f64).abs() < 1e-12 * d);
            }
        }
    }

    #[test]
    fn weights_without_a_row_scale_are_general() {
        let shape = cotan_geometry::shapes::tetrahedron::<f64>();
        let graph = cotan_laplacian::OneRings::new(shape.connectivity())
            .graph()
            .clone();
        let forward = |k: usize, i: usize| {
            if graph.neighbours()[k].index() > i {
                2.0
            } else {
                1.0
            }
        };
        let ones: Vec<f64> = (0..4)
            .flat_map(|i| graph.range(i).map(move |k| (k, i)))
            .map(|(k, i)| forward(k, i))
            .collect();
        let back: Vec<f64> = ones.iter().map(|w| 3.0 - w).collect();
        assert!(row_scale(&graph, &ones, &back, 1e-12).is_none());
    }
}
