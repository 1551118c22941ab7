//! Restriction of an edit to a part of a mesh.

use std::borrow::Cow;

use cotan_geometry::{Positions, Scalar, Surface};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_surface::distances_within;

use super::run::refuse;
use crate::error::Error;

/// The part of a mesh that an edit may move: one weight per vertex in 0 … 1.
///
/// A vertex moves by its weight times the displacement of the edit. Vertices of weight 0 keep
/// their exact positions. For a border without a step, weights should fall to 0 smoothly, as
/// those of [`Mask::inside`] do.
///
/// ```
/// use cotan::prelude::*;
/// use cotan::smooth::Mask;
///
/// let shape = cotan::shapes::icosphere::<f64>(3);
/// let upper = shape.surface().vertices_where(|p| p.z > 0.0);
/// let mask = Mask::inside(&shape.surface(), &upper, 0.5)?;
/// for (v, weight) in mask.weights().iter() {
///     assert!(shape.positions()[v].z > 0.0 || *weight == 0.0);
/// }
/// # Ok::<(), cotan::Error>(())
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct Mask {
    weights: VertexMap<f64>,
}

impl Mask {
    /// Creates a mask from weights.
    ///
    /// # Errors
    /// [`Error::Flow`] for a weight that is not in 0 … 1.
    pub fn new(weights: VertexMap<f64>) -> Result<Self, Error> {
        match weights.values().find(|w| !(0.0..=1.0).contains(*w)) {
            Some(weight) => Err(refuse("weight of a mask", "between 0 and 1", *weight)),
            None => Ok(Self { weights }),
        }
    }

    /// A region with a soft border: 0 outside, and inside
    ///
    /// ```text
    /// 6 t⁵ − 15 t⁴ + 10 t³        t = min(distance from the outside / falloff, 1)
    /// ```
    ///
    /// which has two continuous derivatives. The distance is measured along the surface
    /// ([`distances_within`]). A component without outside has the weight 1.
    ///
    /// **Units**: `falloff` is a length. At 0 the border is a step.
    ///
    /// # Errors
    /// [`Error::Flow`] for a falloff that is negative or not finite, and
    /// [`Error::HandleOutOfRange`] for a vertex that does not exist.
    pub fn inside<T: Scalar>(
        surface: &Surface<'_, T>,
        region: &[VertexId],
        falloff: f64,
    ) -> Result<Self, Error> {
        check_falloff(falloff)?;
        let is_inside = flags(surface, region)?;
        let outside: Vec<VertexId> = surface
            .mesh()
            .vertices()
            .filter(|v| !is_inside[v.index()])
            .collect();
        let far = distances_within(surface, &outside, falloff);
        let weights = far.iter().map(|(v, d)| match is_inside[v.index()] {
            true if *d >= falloff => 1.0,
            true => rise(d / falloff),
            false => 0.0,
        });
        Ok(Self {
            weights: weights.collect(),
        })
    }

    /// The vertices within a distance of some others along the surface, with a soft border as in
    /// [`Self::inside`]: 0 from `radius` on and 1 up to `radius − falloff`.
    ///
    /// # Errors
    /// As [`Self::inside`].
    pub fn around<T: Scalar>(
        surface: &Surface<'_, T>,
        sources: &[VertexId],
        radius: f64,
        falloff: f64,
    ) -> Result<Self, Error> {
        check_falloff(falloff)?;
        if !(radius.is_finite() && radius >= 0.0) {
            return Err(refuse("radius of a mask", "at least 0", radius));
        }
        flags(surface, sources)?;
        let near = distances_within(surface, sources, radius);
        let weights = near.values().map(|d| match radius - d {
            left if left <= 0.0 => 0.0,
            left if left >= falloff => 1.0,
            left => rise(left / falloff),
        });
        Ok(Self {
            weights: weights.collect(),
        })
    }

    /// The weights.
    pub fn weights(&self) -> &VertexMap<f64> {
        &self.weights
    }

    /// The complement: 1 − w.
    #[must_use]
    pub fn inverted(&self) -> Self {
        Self {
            weights: self.weights.map(|w| 1.0 - w),
        }
    }

    /// x⁰ + w (x − x⁰): exactly x⁰ for w = 0 and exactly x for w = 1.
    ///
    /// # Panics
    /// If the three do not have the same length.
    pub fn blend<T: Scalar>(&self, original: &Positions<T>, moved: &Positions<T>) -> Positions<T> {
        assert!(
            original.len() == self.weights.len() && moved.len() == self.weights.len(),
            "one position per weight"
        );
        let ends = original.values().zip(moved.values());
        ends.zip(self.weights.values())
            .map(|((a, b), weight)| match *weight {
                0.0 => *a,
                1.0 => *b,
                weight => a + (b - a) * T::of_f64(weight),
            })
            .collect()
    }

    /// The mask with one weight for all copies of a vertex, that of its row: they move alike.
    pub(crate) fn shared(&self, mesh: &HalfedgeMesh) -> Cow<'_, Self> {
        match mesh.has_copies() {
            false => Cow::Borrowed(self),
            true => Cow::Owned(Self {
                weights: mesh.to_vertices(mesh.to_rows(&self.weights)),
            }),
        }
    }

    /// # Errors
    /// [`Error::FieldLength`] if the mask is for a mesh with another number of vertices.
    pub(crate) fn check(&self, num_vertices: usize) -> Result<(), Error> {
        match self.weights.len() == num_vertices {
            true => Ok(()),
            false => Err(Error::FieldLength {
                what: "the mask",
                len: self.weights.len(),
                num_vertices,
            }),
        }
    }

    /// Adds the vertices of weight 0 to those that are held.
    pub(crate) fn hold(&self, held: &mut [bool]) {
        for (held, weight) in held.iter_mut().zip(self.weights.values()) {
            *held |= *weight == 0.0;
        }
    }
}

/// 6 t⁵ − 15 t⁴ + 10 t³.
fn rise(t: f64) -> f64 {
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

fn check_falloff(falloff: f64) -> Result<(), Error> {
    match falloff.is_finite() && falloff >= 0.0 {
        true => Ok(()),
        false => Err(refuse("falloff of a mask", "at least 0", falloff)),
    }
}

/// Which vertices are in a list.
fn flags<T: Scalar>(surface: &Surface<'_, T>, vertices: &[VertexId]) -> Result<Vec<bool>, Error> {
    let num_vertices = surface.mesh().num_vertices();
    let mut is_in = vec![false; num_vertices];
    for &vertex in vertices {
        match is_in.get_mut(vertex.index()) {
            Some(flag) => *flag = true,
            None => {
                return Err(Error::HandleOutOfRange {
                    group: 0,
                    vertex,
                    num_vertices,
                });
            }
        }
    }
    Ok(is_in)
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::icosphere;

    use super::*;

    #[test]
    fn weights_outside_of_0_to_1_are_refused() {
        for weight in [-0.1, 1.5, f64::NAN] {
            assert!(Mask::new(VertexMap::filled(3, weight)).is_err());
        }
        let shape = icosphere::<f64>(1);
        assert!(Mask::inside(&shape.surface(), &[], -1.0).is_err());
        assert!(Mask::inside(&shape.surface(), &[VertexId::new(99)], 1.0).is_err());
    }
}
