//! A soft volume: bodies resist being hollowed out, and grow thinner where they are stretched.

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::VertexId;
use cotan_laplacian::Fans;
use cotan_parallel as parallel;
use nalgebra::Vector3;

use super::Energy;
use super::bodies::Bodies;
use crate::rest::Rest;

/// The volumes of the closed [`Bodies`], each with an energy
///
/// ```text
/// κ (V − V⁰)²,   κ = γ μ A / V⁰²
/// ```
///
/// with A the body's area.
#[derive(Debug)]
pub(super) struct SoftVolume {
    bodies: Vec<Body>,
    /// The index of each vertex's body, copies of vertices included; that of none where a body
    /// has no volume.
    of_vertex: Vec<u32>,
    /// True if the faces at a vertex run against those of the body; empty if none do.
    is_reversed: Vec<bool>,
    /// ∂V/∂x, and x·∂V/∂x about the body's first vertex.
    gradients: Vec<[f64; 3]>,
    moments: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Body {
    first: usize,
    /// V⁰, and κ over μ.
    rest: f64,
    stiffness: f64,
    /// V as it was measured last, and the sum of the sizes of its terms.
    now: f64,
    size: f64,
}

const NONE: u32 = u32::MAX;

impl SoftVolume {
    /// Volumes of weight γ = `stiffness`.
    pub(super) fn new<T: Scalar>(rest: &Rest<T>, bodies: &Bodies, stiffness: f64) -> Self {
        /// Bodies that enclose less, of the cube of the root of their area, are sheets. A ball
        /// encloses 0.094.
        const MIN_VOLUME: f64 = 1e-3;
        let mut index_of = Vec::new();
        let mut held = Vec::new();
        for body in bodies.all() {
            let encloses = body.volume.abs() > MIN_VOLUME * body.area.powf(1.5);
            if body.is_open || !encloses {
                index_of.push(NONE);
                continue;
            }
            index_of.push(held.len() as u32);
            held.push(Body {
                first: body.first,
                rest: body.volume,
                stiffness: stiffness * body.area / body.volume.powi(2),
                now: body.volume,
                size: 0.0,
            });
        }
        let n = if held.is_empty() {
            0
        } else {
            rest.mesh().num_vertices()
        };
        let mut volume = Self {
            of_vertex: (0..n).map(|i| index_of[bodies.of(i) as usize]).collect(),
            is_reversed: Vec::new(),
            gradients: vec![[0.0; 3]; n],
            moments: vec![0.0; n],
            bodies: held,
        };
        if (0..n).any(|v| bodies.is_reversed(v)) {
            volume.is_reversed = (0..n).map(|v| bodies.is_reversed(v)).collect();
        }
        // As it is measured later: a shape at rest pulls by nothing at all.
        let _ = volume.measure(rest, rest.positions());
        for body in &mut volume.bodies {
            body.rest = body.now;
        }
        volume
    }

    pub(super) fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }

    /// Measures the volumes at these positions. Returns their energy, over μ.
    pub(super) fn measure<T: Scalar>(
        &mut self,
        rest: &Rest<T>,
        positions: &Positions<T>,
    ) -> Energy {
        let (mesh, fans, x) = (rest.mesh(), rest.fans(), positions.as_slice());
        let (bodies, of_vertex) = (&self.bodies, &self.of_vertex);
        let is_reversed = &self.is_reversed;
        parallel::update(
            (&mut self.gradients[..], &mut self.moments[..]),
            |v, (gradient, moment)| {
                let Some(body) = bodies.get(of_vertex[v] as usize) else {
                    return;
                };
                let i = mesh.row_of(VertexId::new(v)).index();
                let mut vector = fans.area_vector(positions, v, i) / 3.0;
                if is_reversed.get(v) == Some(&true) {
                    vector = -vector;
                }
                *moment = (x[i] - x[body.first]).map(T::as_f64).dot(&vector) / 3.0;
                *gradient = vector.into();
            },
        );
        for body in &mut self.bodies {
            (body.now, body.size) = (0.0, 0.0);
        }
        for (of, moment) in self.of_vertex.iter().zip(&self.moments) {
            if let Some(body) = self.bodies.get_mut(*of as usize) {
                body.now += moment;
                body.size += moment.abs();
            }
        }
        let mut energy = Energy::default();
        for body in &self.bodies {
            let gap = body.now - body.rest;
            energy.value += body.stiffness * gap * gap;
            energy.size += body.stiffness * gap.abs() * (gap.abs() + 2.0 * body.size);
        }
        energy
    }

    /// Half the gradient of the volumes' energy at row `i`, over μ.
    #[inline]
    pub(super) fn force_at(&self, fans: &Fans, i: usize) -> Vector3<f64> {
        let mut force = self.of_vertex_at(i);
        for &copy in fans.copies_of(i) {
            force += self.of_vertex_at(copy as usize);
        }
        force
    }

    #[inline]
    fn of_vertex_at(&self, v: usize) -> Vector3<f64> {
        let of = self.of_vertex.get(v).copied().unwrap_or(NONE);
        match self.bodies.get(of as usize) {
            Some(body) => {
                Vector3::from(self.gradients[v]) * (body.stiffness * (body.now - body.rest))
            }
            None => Vector3::zeros(),
        }
    }

    /// Takes the bodies, scaled, for the original ones.
    pub(super) fn resize(&mut self, scale: f64) {
        for body in &mut self.bodies {
            body.rest *= scale.powi(3);
            body.now = body.rest;
            body.stiffness *= scale.powi(-4);
        }
    }

    /// Takes the volumes that were measured last for those of the original, where they are
    /// volumes of that sign and not another body altogether. Returns whether any changed.
    pub(super) fn adopt(&mut self) -> bool {
        let mut is_changed = false;
        for body in &mut self.bodies {
            let ratio = body.now / body.rest;
            if ratio > 0.1 && ratio < 10.0 {
                body.stiffness *= ratio.powf(-4.0 / 3.0);
                body.rest = body.now;
                is_changed = true;
            }
        }
        is_changed
    }
}
