//! The connected components of a surface as bodies: which side is inside, and what they enclose.

use cotan_geometry::Scalar;
use cotan_halfedge::Components;
use nalgebra::Vector3;

use crate::rest::Rest;

/// Components and what they enclose at rest.
#[derive(Debug)]
pub(super) struct Bodies {
    components: Components,
    of_component: Vec<Body>,
}

/// One component.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Body {
    /// The lowest vertex.
    pub(super) first: usize,
    pub(super) is_open: bool,
    /// Signed, in box units: of an open component, that of the cone over it from the centroid of
    /// the surface.
    pub(super) volume: f64,
    pub(super) area: f64,
}

impl Bodies {
    pub(super) fn new<T: Scalar>(rest: &Rest<T>) -> Self {
        let mesh = rest.mesh();
        let components = mesh.components();
        let mut of_component = vec![Body::default(); components.count()];
        for v in mesh.vertices().rev() {
            let body = &mut of_component[components.of(v)];
            body.first = v.index();
            body.is_open |= mesh.is_boundary_vertex(v);
        }
        // Areas and centroids first, then the cones over the faces.
        let corners_of = |f| mesh.triangle(f).map(|v| rest.positions()[v].map(T::as_f64));
        let mut moments = vec![Vector3::zeros(); components.count()];
        for f in mesh.faces() {
            let of = components.of(mesh.triangle(f)[0]);
            let [a, b, c] = corners_of(f);
            let area = 0.5 * (b - a).cross(&(c - a)).norm();
            of_component[of].area += area;
            moments[of] += (a.coords + b.coords + c.coords) * (area / 3.0);
        }
        for f in mesh.faces() {
            let body = &mut of_component[components.of(mesh.triangle(f)[0])];
            let apex = moments[components.of(mesh.triangle(f)[0])] / body.area;
            let [a, b, c] = corners_of(f).map(|p| p.coords - apex);
            body.volume += a.dot(&b.cross(&c)) / 6.0;
        }
        Self {
            components,
            of_component,
        }
    }

    /// The component of vertex `i`.
    pub(super) fn of(&self, i: usize) -> u32 {
        self.components.of_vertices().as_slice()[i]
    }

    pub(super) fn all(&self) -> &[Body] {
        &self.of_component
    }

    /// By what the normal at vertex `i` is to be multiplied to point outwards: 1, or −1 on a body
    /// that is inside out, or 0 where there is no inside.
    pub(super) fn outwards(&self, i: usize) -> f64 {
        let volume = self.of_component[self.of(i) as usize].volume;
        if volume > 0.0 {
            1.0
        } else if volume < 0.0 {
            -1.0
        } else {
            0.0
        }
    }
}
