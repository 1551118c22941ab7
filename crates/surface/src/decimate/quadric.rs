//! Quadrics: sums of squared distances from planes.
//!
//! **Source**: M. Garland, P. Heckbert, "Surface simplification using quadric error metrics",
//! SIGGRAPH 1997. Channels of attributes: H. Hoppe, "New quadric metric for simplifying meshes
//! with appearance attributes", Visualization 1999.

use nalgebra::Vector3;

use super::attributes::Channels;
use crate::triangles::{NONE, Triangles};

/// The function xᵀAx + 2bᵀx + c, and the area that it was summed over.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Quadric {
    /// xx, xy, xz, yy, yz, zz.
    a: [f64; 6],
    b: [f64; 3],
    c: f64,
    area: f64,
}

impl Quadric {
    /// `weight` times the squared distance from the plane through `point` with the unit normal
    /// `n`.
    fn plane(n: Vector3<f64>, point: Vector3<f64>, weight: f64) -> Self {
        let d = -n.dot(&point);
        let [x, y, z] = [n.x, n.y, n.z];
        let w = weight;
        Self {
            a: [
                w * x * x,
                w * x * y,
                w * x * z,
                w * y * y,
                w * y * z,
                w * z * z,
            ],
            b: [w * d * x, w * d * y, w * d * z],
            c: w * d * d,
            area: 0.0,
        }
    }

    /// `weight` times the squared distance from a point.
    fn point(p: Vector3<f64>, weight: f64) -> Self {
        let w = weight;
        Self {
            a: [w, 0.0, 0.0, w, 0.0, w],
            b: [-w * p.x, -w * p.y, -w * p.z],
            c: w * p.norm_squared(),
            area: 0.0,
        }
    }

    #[inline]
    pub(crate) fn add(&mut self, other: &Self) {
        for k in 0..6 {
            self.a[k] += other.a[k];
        }
        for k in 0..3 {
            self.b[k] += other.b[k];
        }
        self.c += other.c;
        self.area += other.area;
    }

    #[inline]
    fn apply(&self, x: &Vector3<f64>) -> Vector3<f64> {
        let a = &self.a;
        Vector3::new(
            a[0] * x.x + a[1] * x.y + a[2] * x.z,
            a[1] * x.x + a[3] * x.y + a[4] * x.z,
            a[2] * x.x + a[4] * x.y + a[5] * x.z,
        )
    }

    /// The value at `x`.
    #[inline]
    pub(crate) fn at(&self, x: &Vector3<f64>) -> f64 {
        let b = Vector3::from(self.b);
        (x.dot(&(self.apply(x) + 2.0 * b)) + self.c).max(0.0)
    }

    /// The root mean square of the distances, if the value is `cost`.
    #[inline]
    pub(crate) fn distance(&self, cost: f64) -> f64 {
        if self.area > 0.0 {
            (cost / self.area).sqrt()
        } else {
            0.0
        }
    }

    /// The minimum, found as a step from `start` so that its error is relative to the step.
    ///
    /// A is positive definite, since every triangle adds a distance from its own corners; its
    /// factors L D Lᵀ need no pivots.
    #[inline]
    pub(crate) fn minimum(&self, start: &Vector3<f64>) -> Option<Vector3<f64>> {
        let a = &self.a;
        let r = -(self.apply(start) + Vector3::from(self.b));
        let d0 = a[0];
        let i0 = 1.0 / d0;
        let (l10, l20) = (a[1] * i0, a[2] * i0);
        let d1 = a[3] - l10 * a[1];
        let i1 = 1.0 / d1;
        let m21 = a[4] - l20 * a[1];
        let l21 = m21 * i1;
        let d2 = a[5] - l20 * a[2] - l21 * m21;
        if !(d0 > 0.0 && d1 > 0.0 && d2 > 0.0) {
            return None;
        }
        let y0 = r.x;
        let y1 = r.y - l10 * y0;
        let y2 = r.z - l20 * y0 - l21 * y1;
        let z = y2 / d2;
        let y = y1 * i1 - l21 * z;
        let x = y0 * i0 - l10 * y - l20 * z;
        let found = start + Vector3::new(x, y, z);
        (found.x.is_finite() && found.y.is_finite() && found.z.is_finite()).then_some(found)
    }

    /// Removes what the best value of a channel takes away: with the sums g and d of its
    /// gradients and offsets over the area α, −(1/α) (gᵀx + d)².
    fn reduce(&mut self, sum: &ChannelSum) {
        let [x, y, z, d, area] = *sum;
        if !(area > 0.0) {
            return;
        }
        let inverse = -1.0 / area;
        let products = [x * x, x * y, x * z, y * y, y * z, z * z];
        for k in 0..6 {
            self.a[k] += inverse * products[k];
        }
        for (b, g) in self.b.iter_mut().zip([x, y, z]) {
            *b += inverse * g * d;
        }
        self.c += inverse * d * d;
    }
}

/// A quadric per vertex, and the sums of its channels.
#[derive(Clone, Debug)]
pub(crate) struct Quadrics {
    base: Vec<Quadric>,
    num_channels: usize,
    sums: Vec<ChannelSum>,
}

/// Per vertex and channel: the gradient and the offset, summed over the area, and that area.
type ChannelSum = [f64; 5];

impl Quadrics {
    /// The quadrics of the triangles and of the tagged edges.
    pub(crate) fn new(triangles: &Triangles, channels: &Channels) -> Self {
        let num_channels = channels.num_channels();
        if num_channels == 0 {
            return Self {
                base: cotan_parallel::filled(triangles.points.len(), |v| {
                    if triangles.has_vertex(v as u32) {
                        around(triangles, channels, v as u32).0
                    } else {
                        Quadric::default()
                    }
                }),
                num_channels,
                sums: Vec::new(),
            };
        }
        let per_vertex = cotan_parallel::filled(triangles.points.len(), |v| {
            let v = v as u32;
            if triangles.has_vertex(v) {
                around(triangles, channels, v)
            } else {
                (Quadric::default(), vec![[0.0; 5]; num_channels])
            }
        });
        let mut base = Vec::with_capacity(per_vertex.len());
        let mut sums = Vec::with_capacity(per_vertex.len() * num_channels);
        for (quadric, channel_sums) in per_vertex {
            base.push(quadric);
            sums.extend(channel_sums);
        }
        Self {
            base,
            num_channels,
            sums,
        }
    }

    /// The quadric of the vertex that replaces `u` and `v`.
    #[inline]
    pub(crate) fn merged(&self, u: u32, v: u32) -> Quadric {
        let mut sum = self.base[u as usize];
        sum.add(&self.base[v as usize]);
        if self.num_channels > 0 {
            for k in 0..self.num_channels {
                sum.reduce(&self.merged_channel(u, v, k));
            }
        }
        sum
    }

    /// Adds the quadric of `u` to that of `v`.
    pub(crate) fn merge(&mut self, u: u32, v: u32) {
        let from = self.base[u as usize];
        self.base[v as usize].add(&from);
        for k in 0..self.num_channels {
            self.sums[v as usize * self.num_channels + k] = self.merged_channel(u, v, k);
        }
    }

    /// The best value of channel `k` at vertex `v`, if the vertex is at `x`.
    pub(crate) fn channel_at(&self, v: u32, k: usize, x: &Vector3<f64>) -> Option<f64> {
        let [gx, gy, gz, d, area] = self.sums[v as usize * self.num_channels + k];
        (area > 0.0).then(|| (gx * x.x + gy * x.y + gz * x.z + d) / area)
    }

    fn merged_channel(&self, u: u32, v: u32, k: usize) -> ChannelSum {
        let of = |v: u32| self.sums[v as usize * self.num_channels + k];
        let (a, b) = (of(u), of(v));
        std::array::from_fn(|i| a[i] + b[i])
    }
}

/// The quadric of a vertex: a third of each triangle around it, and the planes through the tagged
/// edges that are perpendicular to their triangles.
fn around(triangles: &Triangles, channels: &Channels, v: u32) -> (Quadric, Vec<ChannelSum>) {
    let mut sum = Quadric::default();
    let mut channel_sums = vec![[0.0; 5]; channels.num_channels()];
    // Values of two sides are not summed: the vertices of a line at which they may jump have none.
    let has_jump = channels.may_jump && is_on_inner_line(triangles, v);
    for h in triangles.ring(v) {
        let corners = triangles.corners(h / 3);
        let [a, b, c] = corners.map(|w| triangles.point(w));
        let n = (b - a).cross(&(c - a));
        let double_area = n.norm();
        if double_area > 0.0 {
            let weight = double_area / 6.0;
            let n = n / double_area;
            let center = (a + b + c) / 3.0;
            sum.add(&Quadric::plane(n, center, weight));
            sum.area += weight;
            sum.add(&Quadric::point(center, ROUNDNESS * weight));
            let counted = if has_jump {
                &mut [][..]
            } else {
                &mut channel_sums
            };
            for (k, channel_sum) in counted.iter_mut().enumerate() {
                let first = 3 * (h / 3);
                let values = [0, 1, 2].map(|i| channels.at_corner(first + i, k));
                let (g, d) = gradient([a, b, c], n, double_area, values);
                let (g, d) = (g * weight, d * weight);
                for (sum, term) in channel_sum.iter_mut().zip([g.x, g.y, g.z, d, weight]) {
                    *sum += term;
                }
                let scale = 1.0 / weight;
                let products = [
                    g.x * g.x,
                    g.x * g.y,
                    g.x * g.z,
                    g.y * g.y,
                    g.y * g.z,
                    g.z * g.z,
                ];
                for (a, product) in sum.a.iter_mut().zip(products) {
                    *a += scale * product;
                }
                for (b, g) in sum.b.iter_mut().zip([g.x, g.y, g.z]) {
                    *b += scale * g * d;
                }
                sum.c += scale * d * d;
            }
            for side in [h, crate::triangles::prev(h)] {
                if triangles.tag(side) != NONE {
                    let (p, q) = (triangles.origin(side), triangles.target(side));
                    let along = triangles.point(q) - triangles.point(p);
                    let across = along.cross(&n);
                    if let Some(across) = across.try_normalize(0.0) {
                        let weight = LINE_WEIGHT * along.norm_squared();
                        sum.add(&Quadric::plane(across, triangles.point(p), weight));
                    }
                }
            }
        }
    }
    if !(sum.area > 0.0) {
        sum.add(&Quadric::point(
            triangles.point(v),
            f64::MIN_POSITIVE.sqrt(),
        ));
    }
    (sum, channel_sums)
}

/// Returns true if a kept line with triangles on both sides passes through `v`.
pub(super) fn is_on_inner_line(triangles: &Triangles, v: u32) -> bool {
    triangles
        .ring(v)
        .any(|h| triangles.tag(h) != NONE && triangles.twin(h) != NONE)
}

/// The gradient of a linear function within a triangle, and its value at the origin.
fn gradient(
    [a, b, c]: [Vector3<f64>; 3],
    n: Vector3<f64>,
    double_area: f64,
    values: [f64; 3],
) -> (Vector3<f64>, f64) {
    let turned = |from: Vector3<f64>, to: Vector3<f64>| n.cross(&(to - from)) / double_area;
    let g = turned(b, c) * values[0] + turned(c, a) * values[1] + turned(a, b) * values[2];
    (g, values[0] - g.dot(&a))
}

/// The weight of the distance from the triangle's own centre. It decides where the planes do not,
/// in flat regions, and a move along the surface by 1 costs as much as one off it by 0.001.
const ROUNDNESS: f64 = 1e-6;

/// The weight of a line relative to the squared lengths of its edges. Triangles next to it have
/// about half of that area.
const LINE_WEIGHT: f64 = 10.0;
