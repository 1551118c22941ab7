//! The resistance of a body beyond its surface.

use crate::error::FlowError;

/// The weights of what makes a surface deform like the skin of a solid body.
///
/// **Units**: none; both are ratios to the membrane of the surface, whatever the mesh.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct Stiffness {
    /// β, the weight of the struts, which keep opposite walls at their distance. 0 for none.
    pub struts: f64,
    /// γ, the weight of the volume of closed components. 0 for none.
    pub volume: f64,
}

impl Stiffness {
    /// As a shell that is filled with nothing: neither struts nor volume.
    pub const THIN: Self = Self::new(0.0, 0.0);

    /// As a solid body: the weights that were found best over the reference edits.
    pub const SOLID: Self = Self::new(0.3, 1.0);

    /// With weight β = `struts` and γ = `volume`.
    pub const fn new(struts: f64, volume: f64) -> Self {
        Self { struts, volume }
    }

    pub(super) fn check(&self) -> Result<(), FlowError> {
        let settings = [
            ("weight of the struts", self.struts),
            ("weight of the volume", self.volume),
        ];
        match settings
            .into_iter()
            .find(|(_, w)| !(*w >= 0.0 && *w <= MOST))
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

/// Beyond this the system's factorization says nothing about the energy any more.
const MOST: f64 = 1000.0;

impl Default for Stiffness {
    fn default() -> Self {
        Self::SOLID
    }
}
