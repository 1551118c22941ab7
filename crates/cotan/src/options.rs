//! The settings of a deformation as plain, named values.

use cotan_flow::{
    Acceleration, BestRotation, DEFAULT_ITERATION_LIMIT, DEFAULT_TOLERANCE, Flow, FlowBuilder,
    Hybrid, KeepMagnitude, Limited, Reflect, ReflectFirst, RescaleByArea, Schedule, Start,
    Stiffness,
};
use cotan_geometry::{Scalar, Surface};
use cotan_laplacian::{
    ClampedCotangent, Cotangent, EdgeLength, IntrinsicDelaunay, LaplacianScheme, Tutte, Uniform,
};
use cotan_linear::SystemOptions;

use crate::named::{named, setters};
use crate::part_options::{Parts, Ties};

named!(
    /// The built-in Laplacian schemes.
    SchemeKind, "scheme", {
        /// [`Cotangent`], the scheme of the paper.
        #[default]
        Cotangent = "cotangent",
        /// [`Tutte`].
        Tutte = "tutte",
        /// [`Uniform`].
        Uniform = "uniform",
        /// [`EdgeLength`].
        EdgeLength = "edge-length",
        /// [`ClampedCotangent`].
        Clamped = "clamped",
        /// [`IntrinsicDelaunay`], whose weights are never negative.
        IntrinsicDelaunay = "intrinsic-delaunay",
    }
);

named!(
    /// The built-in orientations.
    OrientationKind, "orientation", {
        /// [`Hybrid`]: an energy between that of the flow and that of as-rigid-as-possible
        /// editing.
        #[default]
        Hybrid = "hybrid",
        /// [`BestRotation`].
        Rotation = "rotation",
        /// [`Limited`].
        Limited = "limited",
        /// [`Limited::exact_magnitude`].
        LimitedMagnitude = "limited-magnitude",
        /// [`Reflect`], the orientation of the paper.
        Reflect = "reflect",
        /// [`ReflectFirst`]: ten steps of the paper's orientation, then [`Limited`]. For
        /// reconstructions.
        ReflectFirst = "reflect-first",
    }
);

/// The size of details where the surface is stretched or compressed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum DetailSize {
    /// Details keep their size (paper, section 3.2).
    #[default]
    Keep,
    /// Details scale with the square root of the surrounding area (paper, section 3.3).
    Rescale,
}

/// The settings of [`crate::deform()`] and [`crate::Session`].
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct DeformOptions {
    /// The scheme that defines the weights.
    pub scheme: SchemeKind,
    /// The rule that turns the Laplacian coordinates.
    pub orientation: OrientationKind,
    /// The bending length of the hybrid orientation, relative to the size of the mesh; see
    /// [`Hybrid`].
    pub bending_length: f64,
    /// The resistance of the body beyond its surface, used by the hybrid orientation; see
    /// [`Stiffness`].
    pub stiffness: Stiffness,
    /// The weight with which a wound-up body is held in that state; see [`Hybrid::hold_winding`].
    pub hold_winding: f64,
    /// The size of details under stretching.
    pub detail_size: DetailSize,
    /// The Laplacian coordinates of the first solve.
    pub start: Start,
    /// The acceleration of the iteration, if any.
    pub acceleration: Acceleration,
    /// The updating ratio over the iterations.
    pub schedule: Schedule,
    /// The run stops when no vertex moves by more than this fraction of the bounding box's
    /// diagonal.
    pub tolerance: f64,
    /// The maximum number of iterations of a run.
    pub iteration_limit: usize,
    /// The solver of the linear system and its memory limit.
    pub system: SystemOptions,
    /// Which parts without handles follow.
    pub parts: Parts,
    /// The ties between parts and those that they follow.
    pub ties: Ties,
}

setters!(DeformOptions {
    scheme: SchemeKind,
    orientation: OrientationKind,
    bending_length: f64,
    stiffness: Stiffness,
    hold_winding: f64,
    detail_size: DetailSize,
    start: Start,
    acceleration: Acceleration,
    schedule: Schedule,
    tolerance: f64,
    iteration_limit: usize,
    system: SystemOptions,
    parts: Parts,
    ties: Ties,
});

impl Default for DeformOptions {
    fn default() -> Self {
        Self {
            scheme: SchemeKind::default(),
            orientation: OrientationKind::default(),
            bending_length: Hybrid::DEFAULT_BENDING_LENGTH,
            stiffness: Stiffness::default(),
            hold_winding: 0.0,
            detail_size: DetailSize::default(),
            start: Start::default(),
            acceleration: Acceleration::default(),
            schedule: Schedule::default(),
            tolerance: DEFAULT_TOLERANCE,
            iteration_limit: DEFAULT_ITERATION_LIMIT,
            system: SystemOptions::default(),
            parts: Parts::default(),
            ties: Ties::default(),
        }
    }
}

impl DeformOptions {
    /// The settings of the paper, sections 3.2 and 3.4: reflection, starting from the original
    /// Laplacian coordinates, no acceleration, and a ratio that falls from 1 to 0.1 in five
    /// steps.
    pub fn paper() -> Self {
        Self {
            orientation: OrientationKind::Reflect,
            start: Start::Original,
            acceleration: Acceleration::Off,
            schedule: Schedule::PAPER,
            ..Self::default()
        }
    }
}

impl DeformOptions {
    /// Adapts these settings for [`crate::reconstruct()`]. The start is set to zero vectors.
    /// [`OrientationKind::Hybrid`] is replaced by [`OrientationKind::ReflectFirst`], because the
    /// membrane of the hybrid knows the directions of the original edges.
    #[must_use]
    pub fn for_reconstruction(mut self) -> Self {
        self.start = Start::Zero;
        // Every component is rebuilt from handles of its own.
        self.parts = Parts::Still;
        if self.orientation == OrientationKind::Hybrid {
            self.orientation = OrientationKind::ReflectFirst;
        }
        self
    }
}

impl SchemeKind {
    /// Creates the scheme with this name.
    pub fn scheme<T: Scalar>(self) -> Box<dyn LaplacianScheme<T>> {
        match self {
            Self::Cotangent => Box::new(Cotangent::default()),
            Self::Tutte => Box::new(Tutte),
            Self::Uniform => Box::new(Uniform),
            Self::EdgeLength => Box::new(EdgeLength),
            Self::Clamped => Box::new(ClampedCotangent::default()),
            Self::IntrinsicDelaunay => Box::new(IntrinsicDelaunay::default()),
        }
    }

    /// The symmetric form of the scheme: that of Tutte's weights has the same fixed points and is
    /// much better behaved.
    pub(crate) fn symmetric_scheme<T: Scalar>(self) -> Box<dyn LaplacianScheme<T>> {
        match self {
            Self::Tutte => Box::new(Uniform),
            other => other.scheme(),
        }
    }
}

impl DeformOptions {
    /// Creates a flow of this surface, which is copied, with these settings. Its parts can then
    /// be replaced by others; see [`Session::from_flow`](crate::Session::from_flow) and
    /// [`deform_with`](crate::deform_with).
    pub fn flow<'m, T: Scalar>(&self, surface: impl Into<Surface<'m, T>>) -> FlowBuilder<T> {
        let surface = surface.into();
        self.apply(Flow::builder(surface.mesh(), surface.positions()))
    }

    /// Applies these settings to a flow.
    pub fn apply<T: Scalar>(&self, flow: FlowBuilder<T>) -> FlowBuilder<T> {
        let flow = flow
            .scheme(self.scheme.scheme())
            .start(self.start)
            .acceleration(self.acceleration)
            .schedule(self.schedule)
            .tolerance(self.tolerance)
            .iteration_limit(self.iteration_limit)
            .system(self.system);
        let flow = match self.detail_size {
            DetailSize::Keep => flow.updater(KeepMagnitude),
            DetailSize::Rescale => flow.updater(RescaleByArea),
        };
        match self.orientation {
            OrientationKind::Hybrid => {
                let hybrid = Hybrid::new(self.bending_length)
                    .stiffness(self.stiffness)
                    .hold_winding(self.hold_winding);
                flow.energy(hybrid)
            }
            OrientationKind::Rotation => flow.orientation(BestRotation::new()),
            OrientationKind::Limited => flow.orientation(Limited::new()),
            OrientationKind::LimitedMagnitude => flow.orientation(Limited::exact_magnitude()),
            OrientationKind::Reflect => flow.orientation(Reflect::new()),
            OrientationKind::ReflectFirst => flow.orientation(ReflectFirst::new(10)),
        }
    }
}
