//! The sets of document vertices that may be one vertex of the surface.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::parsed::Part;

/// The vertices of a document, divided into stretches in vertex order; the first starts at 0.
///
/// A stretch is a contiguous range of vertices and belongs to a group. Vertices are welded only
/// within a group, which may have several stretches. A group is a part, or a layer of one: the
/// same faces again, which must not be joined to the others.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Stretches(Vec<Stretch>);

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Stretch {
    start: usize,
    group: u32,
}

impl Stretches {
    /// Builds the stretches of `parts`.
    ///
    /// Some of their vertices are layers, given as vertex ranges in ascending order with the
    /// layer index.
    pub(super) fn new(parts: &[Part], layers: &[(Range<usize>, u32)]) -> Self {
        let mut stretches = Self::default();
        let mut layers = layers.iter().peekable();
        // The groups of layers are numbered after those of the parts.
        let mut next = parts.len() as u32;
        for (number, part) in (0u32..).zip(parts) {
            let mut groups = BTreeMap::new();
            let mut at = part.vertices.start;
            while let Some((range, layer)) = layers.next_if(|(l, _)| l.start < part.vertices.end) {
                if at < range.start {
                    stretches.push(at, number);
                }
                let group = *groups.entry(*layer).or_insert_with(|| {
                    next += 1;
                    next - 1
                });
                stretches.push(range.start, group);
                at = range.end;
            }
            if at < part.vertices.end {
                stretches.push(at, number);
            }
        }
        stretches
    }

    /// Builds the stretches of new vertices, each a copy of an old one.
    pub(super) fn remapped(&self, old: &[u32]) -> Self {
        let group = self.group_of();
        let mut stretches = Self::default();
        for (start, &old) in old.iter().enumerate() {
            stretches.push(start, group(old as usize));
        }
        stretches
    }

    fn push(&mut self, start: usize, group: u32) {
        if self.0.last().is_none_or(|last| last.group != group) {
            self.0.push(Stretch { start, group });
        }
    }

    /// Returns a function that maps a vertex to the index of its stretch.
    pub(super) fn stretch_of(&self) -> impl Fn(usize) -> usize + use<> {
        let starts: Vec<usize> = self.0.iter().map(|s| s.start).collect();
        move |vertex| match starts.len() {
            0 | 1 => 0,
            _ => starts
                .partition_point(|&start| start <= vertex)
                .saturating_sub(1),
        }
    }

    /// Returns a function that maps a vertex to the index of its group.
    pub(super) fn group_of(&self) -> impl Fn(usize) -> u32 + use<> {
        let stretch = self.stretch_of();
        let groups: Vec<u32> = self.0.iter().map(|s| s.group).collect();
        move |vertex| groups.get(stretch(vertex)).copied().unwrap_or(0)
    }
}
