//! The state of the side panel between frames: the page, and sliders that are being moved.

use cotan_workspace::Smooth;

/// The side panel.
pub(super) struct Pages {
    pub(super) tab: Tab,
    /// The settings of smoothing on the screen until the job that uses them has ended. Otherwise
    /// the sliders show those of the scene.
    pub(super) smooth: Option<Smooth>,
    /// The factor of details on the screen, likewise.
    pub(super) detail: Option<f64>,
    /// The weight that a handle gets when it becomes soft.
    pub(super) soft_weight: f64,
    /// The distance within which *Select near* selects, as a share of the longest side.
    pub(super) near: f64,
    /// The new name of the active handle while it is typed.
    pub(super) name: Option<String>,
}

/// The pages.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Tab {
    Deform,
    Smooth,
    Paint,
    Sphere,
}

impl Default for Pages {
    fn default() -> Self {
        Self {
            tab: Tab::Deform,
            smooth: None,
            detail: None,
            soft_weight: 100.0,
            near: 0.1,
            name: None,
        }
    }
}

impl Pages {
    /// Lets the sliders show the scene again.
    pub(super) fn forget(&mut self) {
        self.smooth = None;
        self.detail = None;
        self.name = None;
    }
}
