//! The options for the parts of a model that follow.

use clap::Args;
use cotan_tool::handles_file::{Follow, FollowWord, PartSettings, PartWord};

use super::values;
use crate::error::CliError;

/// The parts that follow, and their ties.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct PartsArgs {
    /// Parts without handles follow those that they touch (follow), stay where they are (still),
    /// or only the named or numbered ones follow (only); `cotan info` lists the parts
    #[arg(long, value_name = "follow|still|only NAME...", num_args = 1..)]
    parts: Vec<String>,
    /// Parts that follow nothing
    #[arg(long, value_name = "PART", num_args = 1..)]
    free: Vec<String>,
    /// Two parts that are not tied to each other
    #[arg(long, value_names = ["PART", "PART"], num_args = 2)]
    untie: Vec<String>,
    /// A factor on the stiffness of the ties between parts [default: 1]
    #[arg(long, value_name = "K", value_parser = values::positive)]
    tie_strength: Option<f64>,
}

impl PartsArgs {
    /// The settings that these options make.
    ///
    /// # Errors
    /// [`CliError::Parts`] for words after --parts that do not go together.
    pub(crate) fn settings(&self) -> Result<PartSettings, CliError> {
        let words = |words: &[String]| words.iter().map(|w| PartWord::from(w.as_str())).collect();
        let follow = match self.parts.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            [] => None,
            ["follow"] => Some(Follow::Word(FollowWord::All)),
            ["still"] => Some(Follow::Word(FollowWord::None)),
            ["only", _, ..] => Some(Follow::Only(words(&self.parts[1..]))),
            _ => return Err(CliError::Parts(self.parts.join(" "))),
        };
        let pair =
            |pair: &[String]| Some([pair.first()?.as_str().into(), pair.get(1)?.as_str().into()]);
        Ok(PartSettings {
            follow,
            free: words(&self.free),
            untied: self.untie.chunks(2).filter_map(pair).collect(),
            strength: self.tie_strength,
        })
    }
}
