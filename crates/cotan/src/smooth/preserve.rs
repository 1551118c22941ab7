//! Exact preservation of volume or area, and bounded displacements.

use cotan_geometry::{Positions, Scalar, unit_or_zero};
use cotan_geometry::{Surface, triangle_area_vector};
use cotan_halfedge::{FaceId, HalfedgeMesh, VertexId, VertexMap};
use nalgebra::{Point3, Vector3};

use super::mask::Mask;
use crate::error::Error;

/// The quantity that smoothing preserves exactly.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Preserve {
    /// Nothing: volume and area are whatever the method gives.
    #[default]
    Nothing,
    /// The volume of each closed component, to a relative accuracy of 1e-9 in `f64`.
    Volume,
    /// The area of each component, to a relative accuracy of 1e-9 in `f64`.
    Area,
}

/// Corrects smoothed positions: each component is offset along its vertex normals by the distance
/// that restores its original volume or area, while no vertex moves farther from its original
/// position than the bound.
///
/// x_i(t) = x⁰_i + clamp(x_i + t w_i n_i − x⁰_i, d), with the weights w of the mask (1 without
/// one) and t found by the secant method within a bracket. Held vertices do not move. Components
/// without volume (open ones, if the volume is preserved) are left alone. Of a mesh that was cut,
/// each piece is a component, and vertices with copies are not offset.
pub(crate) struct Correction<'a, T: Scalar> {
    pub(crate) mesh: &'a HalfedgeMesh,
    pub(crate) original: &'a Positions<T>,
    /// One per row.
    pub(crate) held: &'a [bool],
    pub(crate) preserve: Preserve,
    pub(crate) bound: Option<f64>,
    pub(crate) mask: Option<&'a Mask>,
}

impl<T: Scalar> Correction<'_, T> {
    pub(crate) fn apply(&self, smoothed: &Positions<T>) -> Result<Positions<T>, Error> {
        if self.preserve == Preserve::Nothing && self.bound.is_none() {
            return Ok(smoothed.clone());
        }
        let surface = Surface::new(self.mesh, smoothed)?;
        let mut normals = surface.vertex_normals();
        // Copies of a vertex stay together.
        for (v, normal) in normals.iter_mut() {
            if self.mesh.is_shared_vertex(v) {
                *normal = Vector3::zeros();
            }
        }
        let mut result = smoothed.clone();
        for part in parts(self.mesh) {
            let offset = self.offset(&part, smoothed, &normals)?;
            for &v in &part.vertices {
                if !self.is_held(v) {
                    result[v] = self.moved(v, smoothed, &normals, offset).map(T::of_f64);
                }
            }
        }
        Ok(result)
    }

    fn is_held(&self, v: VertexId) -> bool {
        self.held[self.mesh.row_of(v).index()]
    }

    /// The position of a vertex with offset t, in double precision.
    fn moved(
        &self,
        v: VertexId,
        smoothed: &Positions<T>,
        normals: &VertexMap<Vector3<T>>,
        t: f64,
    ) -> Point3<f64> {
        let now = smoothed[v].map(T::as_f64);
        if self.is_held(v) {
            return now;
        }
        let weight = self.mask.map_or(1.0, |mask| mask.weights()[v]);
        let moved = now + normals[v].map(T::as_f64) * (t * weight);
        let Some(bound) = self.bound else {
            return moved;
        };
        let before = self.original[v].map(T::as_f64);
        let way = moved - before;
        if way.norm() > bound {
            before + unit_or_zero(&way) * bound
        } else {
            moved
        }
    }

    /// The offset that restores the original measure of a component.
    fn offset(
        &self,
        part: &Part,
        smoothed: &Positions<T>,
        normals: &VertexMap<Vector3<T>>,
    ) -> Result<f64, Error> {
        let is_open = self.preserve == Preserve::Volume && !part.is_closed;
        if self.preserve == Preserve::Nothing || is_open {
            return Ok(0.0);
        }
        let wanted = self.measure(part, |v| self.original[v].map(T::as_f64));
        if wanted == 0.0 {
            return Ok(0.0);
        }
        let excess = |t: f64| {
            let measured = self.measure(part, |v| self.moved(v, smoothed, normals, t));
            measured / wanted - 1.0
        };
        // A length scale of the component; larger offsets make no sense.
        let reach = self.area(part, |v| self.original[v].map(T::as_f64)).sqrt();
        root(excess, reach).ok_or(Error::CannotPreserve {
            vertex: part.vertices[0],
            bound: self.bound,
        })
    }

    fn measure(&self, part: &Part, at: impl Fn(VertexId) -> Point3<f64>) -> f64 {
        match self.preserve {
            Preserve::Area => self.area(part, at),
            _ => self.volume(part, at),
        }
    }

    fn area(&self, part: &Part, at: impl Fn(VertexId) -> Point3<f64>) -> f64 {
        let area = |f: &FaceId| {
            let [a, b, c] = self.mesh.triangle(*f).map(&at);
            triangle_area_vector(&a, &b, &c).norm()
        };
        part.faces.iter().map(area).sum()
    }

    /// Computed with the apex of all cones at the first vertex of the part, so that no digits are
    /// lost far from the origin.
    fn volume(&self, part: &Part, at: impl Fn(VertexId) -> Point3<f64>) -> f64 {
        let apex = self.original[part.vertices[0]].map(T::as_f64);
        let cone = |f: &FaceId| {
            let [a, b, c] = self.mesh.triangle(*f).map(|v| at(v) - apex);
            a.dot(&b.cross(&c))
        };
        part.faces.iter().map(cone).sum::<f64>() / 6.0
    }
}

/// Vertices and faces of a component.
struct Part {
    vertices: Vec<VertexId>,
    faces: Vec<FaceId>,
    is_closed: bool,
}

fn parts(mesh: &HalfedgeMesh) -> Vec<Part> {
    let components = mesh.pieces();
    let mut parts: Vec<Part> = components
        .sizes()
        .iter()
        .map(|_| Part {
            vertices: Vec::new(),
            faces: Vec::new(),
            is_closed: true,
        })
        .collect();
    for v in mesh.vertices() {
        let part = &mut parts[components.of(v)];
        part.vertices.push(v);
        part.is_closed &= !mesh.is_boundary_vertex(v);
    }
    for f in mesh.faces() {
        parts[components.of(mesh.triangle(f)[0])].faces.push(f);
    }
    parts
}

/// Finds a root near 0 of a relative excess, or returns `None` if there is none within `reach`.
fn root(excess: impl Fn(f64) -> f64, reach: f64) -> Option<f64> {
    let at_zero = excess(0.0);
    if at_zero.abs() <= EXACT {
        return Some(0.0);
    }
    let (mut low, mut high) = bracket(&excess, at_zero, reach)?;
    for _ in 0..200 {
        // The secant step if it falls inside the bracket, otherwise bisection. Every third step
        // bisects anyway, so that neither end stays forever.
        let secant = low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1);
        let t = secant.clamp(low.0.min(high.0), low.0.max(high.0));
        for t in [t, 0.5 * (low.0 + high.0)] {
            let e = excess(t);
            if e.abs() <= EXACT {
                return Some(t);
            }
            if (t - low.0) * (t - high.0) < 0.0 {
                if (e > 0.0) == (low.1 > 0.0) {
                    low = (t, e);
                } else {
                    high = (t, e);
                }
            }
        }
    }
    // The ends are adjacent floating-point numbers, so the accuracy limit is reached.
    let best = if low.1.abs() < high.1.abs() {
        low
    } else {
        high
    };
    (best.1.abs() <= ACCEPTED).then_some(best.0)
}

/// Two offsets with excesses of opposite signs; the first is closer to 0.
fn bracket(
    excess: &impl Fn(f64) -> f64,
    at_zero: f64,
    reach: f64,
) -> Option<((f64, f64), (f64, f64))> {
    let small = 1e-6 * reach;
    let slope = (excess(small) - at_zero) / small;
    if !(slope.abs() * reach > 1e-9) {
        return None;
    }
    let mut last = (0.0, at_zero);
    let mut t = -1.1 * at_zero / slope;
    while t.abs() <= reach {
        let e = excess(t);
        if (e > 0.0) != (at_zero > 0.0) {
            return Some((last, (t, e)));
        }
        last = (t, e);
        t *= 1.5;
    }
    None
}

/// The rounding error of a sum over many faces.
const EXACT: f64 = 1e-13;

/// The documented accuracy.
const ACCEPTED: f64 = 1e-9;
