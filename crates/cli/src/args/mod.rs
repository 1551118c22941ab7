//! Options that several commands share, the types of files on the command line, and parsers of
//! values.

mod embed;
mod limits;
mod mesh;
mod messages;
mod part;
mod parts;
mod paths;
mod precision;
pub(crate) mod values;

pub(crate) use embed::EmbedArgs;
pub(crate) use limits::LimitArgs;
pub(crate) use mesh::MeshArgs;
pub(crate) use messages::Messages;
pub(crate) use part::{PartArgs, RegionArgs, Selection};
pub(crate) use parts::PartsArgs;
pub(crate) use paths::{InputPath, OutputFolder, OutputPath};
pub(crate) use precision::Precision;
