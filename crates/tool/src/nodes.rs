//! The meshes of a glTF by the names of its nodes.

use std::collections::HashSet;

use cotan_io::Node;

/// The parts of the document that the nodes with a name show, in ascending order.
///
/// A node shows its mesh. One without a mesh, which groups others, stands for the meshes below it.
pub(crate) fn parts_of(nodes: &[Node], name: &str) -> Vec<usize> {
    let is_wanted = |node: &Node| node.name == name && !name.is_empty();
    let is_group = |node: &Node| node.part.is_none() && is_wanted(node);
    let mut parts: Vec<usize> = Vec::new();
    for node in nodes {
        let Some(part) = node.part else { continue };
        let above = || ancestors(nodes, node).any(is_group);
        if is_wanted(node) || above() {
            parts.push(part);
        }
    }
    parts.sort_unstable();
    parts.dedup();
    parts
}

/// The names that stand for each of `num_parts` parts: those of the nodes that show it, and then
/// those of the groups that they are in, each once.
pub(crate) fn names_of(nodes: &[Node], num_parts: usize) -> Vec<Vec<&str>> {
    let mut names = vec![Vec::new(); num_parts];
    let mut seen = HashSet::new();
    let mut add = |part: Option<usize>, name| {
        let Some(names) = part.and_then(|part| names.get_mut(part)) else {
            return;
        };
        if seen.insert((part, name)) {
            names.push(name);
        }
    };
    for node in nodes.iter().filter(|node| !node.name.is_empty()) {
        add(node.part, node.name.as_str());
    }
    for node in nodes.iter().filter(|node| node.part.is_some()) {
        let groups = ancestors(nodes, node).filter(|above| above.part.is_none());
        for group in groups.filter(|group| !group.name.is_empty()) {
            add(node.part, group.name.as_str());
        }
    }
    names
}

/// The nodes above a node, from its parent on. The reader has checked that nodes form trees.
fn ancestors<'a>(nodes: &'a [Node], node: &Node) -> impl Iterator<Item = &'a Node> {
    let parent = |node: &Node| node.parent.and_then(|parent| nodes.get(parent));
    std::iter::successors(parent(node), move |node| parent(node))
}
