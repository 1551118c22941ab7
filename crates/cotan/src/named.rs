//! Values with names, and the setters of option structs.

use thiserror::Error;

/// A name that does not match any built-in value.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[error("there is no {what} named \"{name}\"; the names are {known}")]
pub struct UnknownName {
    /// The kind of value that was requested.
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
            /// All values.
            pub const ALL: &[Self] = &[$(Self::$variant),+];

            /// The name on the command line.
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

/// Generates a method for each setting that returns the settings with a new value for it.
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
