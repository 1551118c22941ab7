//! Which parts follow, as a handles file says: `{"parts": {"follow": …, "free": …, "untied": …,
//! "strength": K}}`.

use cotan::{DeformOptions, Parts};
use serde::Deserialize;

use crate::part_names::{PartNames, UnknownPart};

/// The member `parts` of a handles file; parts by name or number.
#[derive(Clone, PartialEq, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PartSettings {
    /// Which parts follow: `"all"`, `"none"`, or a list.
    pub follow: Option<Follow>,
    /// Parts that follow nothing.
    pub free: Vec<PartWord>,
    /// Pairs that are not tied to each other.
    pub untied: Vec<[PartWord; 2]>,
    /// A factor on the stiffness of ties.
    pub strength: Option<f64>,
}

/// Which parts follow.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(untagged)]
pub enum Follow {
    /// `"all"` or `"none"`.
    Word(FollowWord),
    /// These.
    Only(Vec<PartWord>),
}

/// All parts or none.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FollowWord {
    /// All parts follow.
    All,
    /// No part follows.
    None,
}

/// The name or number of a part.
#[derive(Clone, PartialEq, Eq, Debug, Deserialize)]
#[serde(untagged)]
pub enum PartWord {
    /// Its number in the order of the file.
    Number(usize),
    /// Its name.
    Name(String),
}

impl PartWord {
    /// The components of the surface that it means.
    ///
    /// # Errors
    /// [`UnknownPart`] with the names that exist.
    pub fn find(&self, names: &PartNames) -> Result<Vec<usize>, UnknownPart> {
        match self {
            Self::Number(number) => names.find(&number.to_string()),
            Self::Name(name) => names.find(name),
        }
    }
}

impl From<&str> for PartWord {
    fn from(word: &str) -> Self {
        Self::Name(word.to_owned())
    }
}

impl PartSettings {
    /// These settings, and those of `over` where it has any.
    #[must_use]
    pub fn overridden_by(mut self, over: Self) -> Self {
        self.follow = over.follow.or(self.follow);
        self.strength = over.strength.or(self.strength);
        self.free.extend(over.free);
        self.untied.extend(over.untied);
        self
    }

    /// Options with these settings.
    ///
    /// # Errors
    /// [`UnknownPart`] for a part that the model does not have.
    pub fn apply(
        &self,
        mut options: DeformOptions,
        names: &PartNames,
    ) -> Result<DeformOptions, UnknownPart> {
        let all = |words: &[PartWord]| {
            let found = words.iter().map(|word| word.find(names));
            Ok::<_, UnknownPart>(found.collect::<Result<Vec<_>, _>>()?.concat())
        };
        match &self.follow {
            None => {}
            Some(Follow::Word(FollowWord::All)) => options.parts = Parts::Follow,
            Some(Follow::Word(FollowWord::None)) => options.parts = Parts::Still,
            Some(Follow::Only(words)) => options.parts = Parts::Only(all(words)?),
        }
        options.ties.free.extend(all(&self.free)?);
        for [a, b] in &self.untied {
            let (left, right) = (a.find(names)?, b.find(names)?);
            let pairs = left
                .iter()
                .flat_map(|a| right.iter().map(move |b| [*a, *b]));
            options.ties.untied.extend(pairs);
        }
        if let Some(strength) = self.strength {
            options.ties.strength = strength;
        }
        Ok(options)
    }
}
