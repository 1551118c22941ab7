//! A value that is computed once from a rest shape.

use cotan_geometry::Scalar;

use crate::rest::{Identity, Rest};

/// A value that follows from the rest shape alone: computed on its first use, and again
/// only for another rest shape.
///
/// An updater or orientation keeps one of these for what it measures on the original mesh. There
/// is no method to call first and none that a wrapper could forget to forward.
///
/// ```
/// use cotan_flow::{PerRest, Rest};
/// use cotan_laplacian::Cotangent;
///
/// let shape = cotan_geometry::shapes::icosphere::<f64>(1);
/// let rest = Rest::new(shape.connectivity(), shape.positions(), Cotangent::default())?;
/// let mut longest = PerRest::new();
/// let measure = |rest: &Rest<f64>| rest.magnitudes().values().copied().fold(0.0, f64::max);
/// assert!(*longest.get(&rest, measure) > 0.0);
/// # Ok::<(), cotan_flow::FlowError>(())
/// ```
#[derive(Clone, Debug)]
pub struct PerRest<V> {
    of: Option<(Identity, V)>,
}

impl<V> PerRest<V> {
    /// Nothing is computed yet.
    pub const fn new() -> Self {
        Self { of: None }
    }

    /// The value for `rest`; `make` computes it if it is not known yet.
    pub fn get<T: Scalar>(&mut self, rest: &Rest<T>, make: impl FnOnce(&Rest<T>) -> V) -> &mut V {
        let known = self.of.take().filter(|(of, _)| of.is_of(rest));
        let (_, value) = self
            .of
            .insert(known.unwrap_or_else(|| (rest.identity().clone(), make(rest))));
        value
    }
}

impl<V> Default for PerRest<V> {
    fn default() -> Self {
        Self::new()
    }
}

/// Two of these are equal whatever they have computed: that is no part of the settings.
impl<V> PartialEq for PerRest<V> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{icosphere, torus};
    use cotan_laplacian::Cotangent;

    use super::*;

    #[test]
    fn a_value_is_computed_once_for_every_rest_shape() {
        let [a, b] = [icosphere::<f64>(1), torus::<f64>(1.0, 0.3, 8, 6)]
            .map(|s| Rest::new(s.connectivity(), s.positions(), Cotangent::default()).unwrap());
        let mut computed = 0;
        let mut count = PerRest::new();
        for rest in [&a, &a, &b, &b] {
            let n = *count.get(rest, |rest| {
                computed += 1;
                rest.positions().len()
            });
            assert_eq!(n, rest.positions().len());
        }
        assert_eq!(computed, 2);
    }
}
