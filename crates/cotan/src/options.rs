//! The settings of a deformation, as plain values with names.

use cotan_flow::{
    Acceleration, BestRotation, DEFAULT_ITERATION_LIMIT, DEFAULT_TOLERANCE, Flow, FlowBuilder,
    Hybrid, KeepMagnitude, Limited, Reflect, ReflectFirst, RescaleByArea, Schedule, Start,
    Stiffness,
};
use cotan_geometry::{Scalar, Surface};
use cotan_laplacian::{ClampedCotangent, Cotangent, EdgeLength, LaplacianScheme, Tutte, Uniform};
use cotan_linear::SystemOptions;
use thiserror::Error;

/// A name that no built-in has.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[error("there is no {what} named \"{name}\"; the names are {known}")]
pub struct UnknownName {
    /// What was asked for.
    pub what: &'static str,
    /// The name that was given.
    pub name: String,
    /// The names that exist.
    pub known: String,
}

macro_rules! named {
    ($(#[$doc:meta])* $type:ident, $what:literal, { $($(#[$variant_doc:meta])* $variant:ident = $name:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
        #[non_exhaustive]
        pub enum $type {
            $($(#[$variant_doc])* $variant,)+
        }

        impl $type {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$variant),+];

            /// Its name on the command line.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),+ }
            }
        }

        impl std::str::FromStr for $type {
            type Err = $crate::UnknownName;

            fn from_str(name: &str) -> Result<Self, $crate::UnknownName> {
                Self::ALL.iter().copied().find(|kind| kind.name() == name).ok_or_else(|| {
                    $crate::UnknownName {
                        what: $what,
                        name: name.into(),
                        known: [$($name),+].join(", "),
                    }
                })
            }
        }
    };
}

pub(crate) use named;

/// A method for each setting that gives the settings with another value of it.
macro_rules! setters {
    ($type:ident { $($name:ident: $value:ty),+ $(,)? }) => {
        impl $type {
            $(
                #[doc = concat!(
                    "These settings with another [`", stringify!($name), "`](Self#structfield.",
                    stringify!($name), ")."
                )]
                #[must_use]
                pub fn $name(mut self, $name: $value) -> Self {
                    self.$name = $name.into();
                    self
                }
            )+
        }
    };
}

pub(crate) use setters;

named!(
    /// The built-in Laplacian schemes.
    SchemeKind, "scheme", {
        /// [`Cotangent`]: the paper's.
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
    }
);

named!(
    /// The built-in orientations; see `docs/decisions` for how they compare.
    OrientationKind, "orientation", {
        /// [`Hybrid`]: an energy between the flow's and as-rigid-as-possible editing's.
        #[default]
        Hybrid = "hybrid",
        /// [`BestRotation`].
        Rotation = "rotation",
        /// [`Limited`].
        Limited = "limited",
        /// [`Limited::exact_magnitude`].
        LimitedMagnitude = "limited-magnitude",
        /// [`Reflect`]: the paper's.
        Reflect = "reflect",
        /// [`ReflectFirst`]: ten steps of the paper's, then [`Limited`]; for reconstructions.
        ReflectFirst = "reflect-first",
    }
);

/// What happens to the size of details where the surface is stretched or squeezed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum DetailSize {
    /// They keep their size (paper, section 3.2).
    #[default]
    Keep,
    /// They scale with the square root of the area around them (paper, section 3.3).
    Rescale,
}

/// The settings of [`crate::deform()`] and [`crate::Session`].
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct DeformOptions {
    /// The scheme that chooses the weights.
    pub scheme: SchemeKind,
    /// How Laplacian coordinates are turned.
    pub orientation: OrientationKind,
    /// The hybrid's bending length, relative to the size of the mesh; see [`Hybrid`].
    pub bending_length: f64,
    /// The resistance of a body beyond its surface, by the hybrid; see [`Stiffness`].
    pub stiffness: Stiffness,
    /// The weight by which a body that was wound up is held so; see [`Hybrid::hold_winding`].
    pub hold_winding: f64,
    /// What happens to the size of details.
    pub detail_size: DetailSize,
    /// The Laplacian coordinates of the first solve.
    pub start: Start,
    /// Whether and how to accelerate.
    pub acceleration: Acceleration,
    /// The updating ratio over the iterations.
    pub schedule: Schedule,
    /// Stop when no vertex moves by more than this ratio of the bounding box's diagonal.
    pub tolerance: f64,
    /// The most iterations of a run.
    pub iteration_limit: usize,
    /// How the linear system is solved, and what memory it may take.
    pub system: SystemOptions,
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
        }
    }
}

impl DeformOptions {
    /// The paper's own settings, sections 3.2 and 3.4: reflection, original Laplacian coordinates
    /// first, no acceleration, the ratio falling from 1 to 0.1 in five steps.
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
    /// These settings for [`crate::reconstruct()`]: from zero vectors; and as the hybrid's membrane
    /// knows the directions of the original edges, [`OrientationKind::ReflectFirst`] in its place.
    #[must_use]
    pub fn for_reconstruction(mut self) -> Self {
        self.start = Start::Zero;
        if self.orientation == OrientationKind::Hybrid {
            self.orientation = OrientationKind::ReflectFirst;
        }
        self
    }
}

impl SchemeKind {
    /// The scheme with this name.
    pub fn scheme<T: Scalar>(self) -> Box<dyn LaplacianScheme<T>> {
        match self {
            Self::Cotangent => Box::new(Cotangent::default()),
            Self::Tutte => Box::new(Tutte),
            Self::Uniform => Box::new(Uniform),
            Self::EdgeLength => Box::new(EdgeLength),
            Self::Clamped => Box::new(ClampedCotangent::default()),
        }
    }
}

impl DeformOptions {
    /// A flow of this surface, which is copied, with these settings, whose parts can be changed for
    /// others; see [`Session::from_flow`](crate::Session::from_flow) and
    /// [`deform_with`](crate::deform_with).
    pub fn flow<'m, T: Scalar>(&self, surface: impl Into<Surface<'m, T>>) -> FlowBuilder<T> {
        let surface = surface.into();
        self.apply(Flow::builder(surface.mesh(), surface.positions()))
    }

    /// A flow with these settings.
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
