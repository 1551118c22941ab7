//! The settings that belong to a scene: undo brings them back, and a project keeps them.

use cotan::flow::{Acceleration, Schedule};
use cotan::smooth::{SmoothMethod, SmoothOptions};
use cotan::{DeformOptions, DetailSize, OrientationKind, Parts, SchemeKind};
use serde::{Deserialize, Serialize};

use crate::brush::Brush;
use crate::plain;

/// All settings of a scene.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Settings of a deformation.
    pub follow: Follow,
    /// Settings of smoothing.
    pub smooth: Smooth,
    /// The factor of the last edit of details; 1 if the shape was changed otherwise since.
    pub detail: f64,
    /// The share of areas against angles that a map to the sphere keeps, from 0 to 1.
    pub areas: f64,
    /// The width over which jobs fade at the border of a selection, as a share of the longest
    /// side of the model's box.
    pub border: f64,
    /// The brush that paints the curvature field.
    pub brush: Brush,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            follow: Follow::default(),
            smooth: Smooth::default(),
            detail: 1.0,
            areas: 0.0,
            border: 0.05,
            brush: Brush::default(),
        }
    }
}

impl Settings {
    /// The first setting that is out of range, as a message.
    pub(crate) fn problem(&self) -> Option<&'static str> {
        let share = |x: f64| (0.0..=1.0).contains(&x);
        let Influence { radius, falloff } = self.follow.influence.unwrap_or_default();
        match () {
            () if !share(self.smooth.strength) => Some("the strength is not between 0 and 1"),
            () if self.smooth.iterations.is_some_and(|n| n > MOST_ITERATIONS) => {
                Some("there are too many iterations")
            }
            () if !(self.detail.is_finite() && self.detail.abs() <= MOST_DETAIL) => {
                Some("the factor of the details is not between -100 and 100")
            }
            () if !share(self.areas) => Some("the share of areas is not between 0 and 1"),
            () if !share(self.border) => Some("the border is not between 0 and 1"),
            () if !(radius.is_finite() && radius > 0.0) => Some("the reach is not above 0"),
            () if !share(falloff) => Some("the falloff is not between 0 and 1"),
            () => self.brush.problem(),
        }
    }
}

const MOST_ITERATIONS: usize = 10_000;
const MOST_DETAIL: f64 = 100.0;

/// Settings of a deformation.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Follow {
    /// The rule that turns the details.
    #[serde(with = "plain::orientation")]
    pub orientation: OrientationKind,
    /// The weights of the surface's edges.
    #[serde(with = "plain::scheme")]
    pub scheme: SchemeKind,
    /// The scaling of details with the surrounding area.
    pub details: Details,
    /// The way in which the shape comes to rest.
    pub way: Way,
    /// The region of influence of the handles; `None` for the whole model.
    pub influence: Option<Influence>,
    /// The parts of the model without handles.
    pub others: Others,
}

/// The parts of the model that have no handles.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Others {
    /// They follow the parts that they touch, or the nearest ones.
    #[default]
    Follow,
    /// They stay where they are.
    Stay,
}

/// Scaling of details with the surrounding area.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Details {
    /// They keep their size.
    #[default]
    Keep,
    /// They grow and shrink with the area around them.
    Grow,
}

/// The way in which the shape comes to rest.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Way {
    /// By acceleration.
    #[default]
    Accelerated,
    /// By the paper's falling ratio.
    Paper,
}

/// The region around the handles that follows them. The rest of the model stays.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Influence {
    /// The distance from the handles along the surface at which the region ends, as a share of the
    /// longest side of the model's box.
    pub radius: f64,
    /// The share of the radius over which the motion fades.
    pub falloff: f64,
}

impl Default for Influence {
    fn default() -> Self {
        Self {
            radius: 0.25,
            falloff: 0.5,
        }
    }
}

impl Follow {
    /// The options of the deformation.
    pub fn options(&self) -> DeformOptions {
        let options = editor_options()
            .orientation(self.orientation)
            .scheme(self.scheme)
            .detail_size(match self.details {
                Details::Keep => DetailSize::Keep,
                Details::Grow => DetailSize::Rescale,
            })
            .parts(match self.others {
                Others::Follow => Parts::Follow,
                Others::Stay => Parts::Still,
            });
        match self.way {
            Way::Accelerated => options,
            Way::Paper => options
                .schedule(Schedule::PAPER)
                .acceleration(Acceleration::Off),
        }
    }
}

/// The defaults of the command line, with a tolerance tight enough that two paths to a shape end
/// at the same shape.
pub fn editor_options() -> DeformOptions {
    DeformOptions::default().tolerance(SETTLED)
}

/// Tolerance relative to the diagonal. The remaining change is far below a pixel, and 1e-6 of the
/// bounding box is met with a margin.
const SETTLED: f64 = 1e-9;

/// Settings of smoothing.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct Smooth {
    /// The method.
    #[serde(with = "plain::smooth_method")]
    pub method: SmoothMethod,
    /// The number of iterations; `None` for the default of the method.
    pub iterations: Option<usize>,
    /// From 0, firmly anchored, to 1. At 0.5 the anchor is as firm as the noise of the mesh allows.
    pub strength: f64,
}

impl Default for Smooth {
    fn default() -> Self {
        Self {
            method: SmoothMethod::default(),
            iterations: None,
            strength: 0.5,
        }
    }
}

impl Smooth {
    /// The number of iterations that will run.
    pub fn num_iterations(&self) -> usize {
        let by_method = || {
            self.method
                .smoother()
                .unwrap_or_default()
                .default_iterations()
        };
        self.iterations.unwrap_or_else(by_method)
    }

    /// The options of the job.
    pub fn options(&self) -> SmoothOptions {
        let anchor = match self.strength {
            s if (s - 0.5).abs() < 0.01 => None,
            s => Some(10_f64.powf(2.0 - 4.0 * s)),
        };
        SmoothOptions::default()
            .method(self.method)
            .iterations(self.iterations)
            .anchor(anchor)
    }
}
