//! The brush that paints the curvature field.

use cotan::geometry::Surface;
use cotan::halfedge::{VertexId, VertexMap};
use cotan::smooth::{
    Blend, BumpSize, BySizeOptions, CurvatureEdit, CurvatureField, DetailOptions, Mask,
    ScaledCurvature, SmoothBySize, edit_detail_masked,
};
use cotan::{Error, Handles};
use serde::{Deserialize, Serialize};

use crate::shape::Shape;
use crate::task::Control;

/// A brush with its settings.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct Brush {
    /// The effect.
    pub paint: Paint,
    /// The radius along the surface, as a share of the longest side of the model's box.
    pub radius: f64,
    /// The share of the radius over which the effect fades.
    pub falloff: f64,
    /// The share of the effect that a stroke has, from 0 to 1.
    pub strength: f64,
}

impl Default for Brush {
    fn default() -> Self {
        Self {
            paint: Paint::Detail(1.5),
            radius: 0.05,
            falloff: 0.8,
            strength: 1.0,
        }
    }
}

/// The effect of a brush on the curvature field.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Paint {
    /// Details become so many times as strong.
    Detail(f64),
    /// Bumps narrower than a share of the longest side of the model's box are removed.
    Smooth(f64),
    /// The mean curvature becomes 0.
    Flatten,
    /// The mean curvature grows by an amount, in units of the inverse longest side.
    Inflate(f64),
}

impl Paint {
    /// The name in the list.
    pub fn name(self) -> &'static str {
        match self {
            Self::Detail(_) => "More or less detail",
            Self::Smooth(_) => "Smooth at a size",
            Self::Flatten => "Flatten",
            Self::Inflate(_) => "Inflate",
        }
    }
}

impl Brush {
    /// The first setting that is out of range, as a message.
    pub(crate) fn problem(&self) -> Option<&'static str> {
        let share = |x: f64| (0.0..=1.0).contains(&x);
        let is_sound = match self.paint {
            Paint::Detail(factor) => (0.0..=4.0).contains(&factor),
            Paint::Smooth(size) => share(size),
            Paint::Flatten => true,
            Paint::Inflate(by) => by.abs() <= 1000.0,
        };
        match () {
            () if !(share(self.radius) && self.radius > 0.0) => {
                Some("the radius of the brush is not above 0 and at most 1")
            }
            () if !share(self.falloff) => Some("the falloff of the brush is not between 0 and 1"),
            () if !share(self.strength) => Some("the strength of the brush is not between 0 and 1"),
            () if !is_sound => Some("the amount of the brush is out of its range"),
            () => None,
        }
    }

    /// The share of each vertex in a stroke through some vertices, within a restriction.
    pub(crate) fn mask(
        &self,
        surface: &Surface<'_, f64>,
        stroke: &[VertexId],
        side: f64,
        allowed: Option<&Mask>,
    ) -> Result<Mask, Error> {
        let radius = self.radius * side;
        let painted = Mask::around(surface, stroke, radius, self.falloff * radius)?;
        let weights = painted.weights().iter().map(|(v, weight)| {
            let allowed = allowed.map_or(1.0, |mask| mask.weights()[v]);
            self.strength * weight * allowed
        });
        Mask::new(weights.collect())
    }

    /// The shape after a stroke.
    pub(crate) fn paint(
        &self,
        surface: &Surface<'_, f64>,
        fixed: &Handles<f64>,
        mask: Mask,
        control: &Control,
    ) -> Result<Shape, Error> {
        let by = |edit: &dyn CurvatureEdit| -> Result<Shape, Error> {
            let options = DetailOptions::default();
            let observer = |done| control.advance(done, options.iterations);
            // The field itself fades: an even change of it would bend nothing.
            let edit = Blend {
                mask: mask.weights().clone(),
                off: ScaledCurvature::by(1.0),
                on: edit,
            };
            let edited = edit_detail_masked(*surface, fixed, &mask, &edit, &options, &observer);
            Ok(Shape::new(edited?.positions))
        };
        match self.paint {
            Paint::Detail(factor) => by(&ScaledCurvature::by(factor)),
            Paint::Flatten => by(&Flat),
            Paint::Inflate(amount) => by(&Raised(amount)),
            Paint::Smooth(size) => {
                let mut job = SmoothBySize::new(*surface, fixed, &BySizeOptions::default())?;
                job.set_mask(mask)?;
                let observer = |done| control.advance(done, 0);
                let smoothed = job.smooth_observed(&BumpSize::Share(size), &observer)?;
                Ok(Shape::new(smoothed.positions))
            }
        }
    }
}

/// H* = 0.
struct Flat;

impl CurvatureEdit for Flat {
    fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64> {
        field.values.map(|_| 0.0)
    }
}

/// H* = H + an amount, in inverse box units.
struct Raised(f64);

impl CurvatureEdit for Raised {
    fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64> {
        field.values.map(|h| h + self.0)
    }
}
