//! The resistance of a body beyond its surface.

use crate::error::FlowError;

/// The weights of what makes a surface deform like the skin of a solid body.
///
/// **Units**: none; the weights are ratios to the membrane of the surface, whatever the mesh.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct Stiffness {
    /// β, the weight of the struts, which keep opposite walls at their distance. 0 for none.
    pub struts: f64,
    /// γ, the weight of the volume of closed components. 0 for none.
    pub volume: f64,
    /// The radius of the disc at which a handle of a single vertex pulls, in bending lengths. 0 to
    /// pull at the vertex itself, which draws the surface to a cone.
    pub point_radius: f64,
}

impl Stiffness {
    /// As a shell that is filled with nothing: neither struts nor volume, and point handles that
    /// pull at their vertices.
    pub const THIN: Self = Self {
        point_radius: 0.0,
        ..Self::new(0.0, 0.0)
    };

    /// As a solid body: the weights that were found best over the reference edits.
    pub const SOLID: Self = Self::new(0.3, 1.0);

    /// With weight β = `struts` and γ = `volume`, and the usual point handles.
    pub const fn new(struts: f64, volume: f64) -> Self {
        Self {
            struts,
            volume,
            point_radius: POINT_RADIUS,
        }
    }

    pub(super) fn check(&self) -> Result<(), FlowError> {
        let settings = [
            ("weight of the struts", self.struts),
            ("weight of the volume", self.volume),
            ("radius of point handles", self.point_radius),
        ];
        match settings
            .into_iter()
            .find(|(_, w)| !(*w >= 0.0 && *w <= MAX))
        {
            None => Ok(()),
            Some((setting, value)) => Err(FlowError::Setting {
                setting,
                range: "between 0 and 1000",
                value,
            }),
        }
    }
}

/// Leaves less than half of the cones of the reference cases.
const POINT_RADIUS: f64 = 6.0;

/// Beyond this the system's factorization says nothing about the energy any more.
const MAX: f64 = 1000.0;

impl Default for Stiffness {
    fn default() -> Self {
        Self::SOLID
    }
}
