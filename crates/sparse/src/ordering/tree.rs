//! The tree of separators, in preorder.

/// A binary tree whose nodes are separators (with two children) or parts that were not split
/// (leaves).
///
/// The nodes below t are t + 1 … `end[t]`: first those of the left child, which is t + 1, then
/// those of the right child. The label of a vertex is the index of its node, so that comparing
/// labels shows on which side of a separator it lies.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Tree {
    end: Vec<u32>,
}

impl Tree {
    pub(super) fn leaf() -> Self {
        Self { end: vec![1] }
    }

    /// Creates a separator above two trees.
    pub(super) fn above(left: &Self, right: &Self) -> Self {
        let mut tree = Self { end: vec![0] };
        tree.append(left);
        tree.append(right);
        tree.end[0] = tree.end.len() as u32;
        tree
    }

    /// Replaces the leaves by other trees, given in the order of the leaves.
    ///
    /// Returns the new tree and the new index of each old node; the node of a leaf becomes the
    /// root of its replacement.
    pub(super) fn replace_leaves(&self, parts: &[Self]) -> (Self, Vec<u32>) {
        let mut parts = parts.iter();
        let mut tree = Self { end: Vec::new() };
        let mut numbers = Vec::with_capacity(self.len());
        for t in 0..self.len() as u32 {
            numbers.push(tree.end.len() as u32);
            let part = if self.is_leaf(t) { parts.next() } else { None };
            match part {
                Some(part) => tree.append(part),
                None => tree.end.push(0),
            }
        }
        let len = tree.end.len() as u32;
        for t in (0..self.len()).filter(|&t| !self.is_leaf(t as u32)) {
            let end = numbers.get(self.end[t] as usize).copied().unwrap_or(len);
            tree.end[numbers[t] as usize] = end;
        }
        (tree, numbers)
    }

    fn append(&mut self, other: &Self) {
        let start = self.end.len() as u32;
        self.end.extend(other.end.iter().map(|end| start + end));
    }

    pub(super) fn len(&self) -> usize {
        self.end.len()
    }

    pub(super) fn is_leaf(&self, t: u32) -> bool {
        self.end[t as usize] == t + 1
    }

    /// One past the last node below t.
    pub(super) fn end(&self, t: u32) -> u32 {
        self.end[t as usize]
    }

    /// The right child of a separator; its left child is t + 1.
    pub(super) fn right(&self, t: u32) -> u32 {
        self.end(t + 1)
    }

    /// Returns `true` if t is `above` or lies below it.
    pub(super) fn is_below(&self, t: u32, above: u32) -> bool {
        above <= t && t < self.end(above)
    }

    /// Returns the node for a vertex whose neighbours have these labels: the deepest node at or
    /// below `root` that is an ancestor or a descendant of every one of them.
    pub(super) fn home(&self, root: u32, labels: impl Iterator<Item = u32>) -> u32 {
        let mut home = root;
        let mut forked = false;
        for label in labels {
            if self.is_below(label, home) {
                if !forked {
                    home = label;
                }
            } else if !self.is_below(home, label) {
                home = self.meet(root, home, label);
                forked = true;
            }
        }
        home
    }

    /// The lowest node that is above both a and b, which are below `root`.
    fn meet(&self, root: u32, a: u32, b: u32) -> u32 {
        let mut meet = root;
        loop {
            let child = [meet + 1, self.right(meet)]
                .into_iter()
                .find(|&child| self.is_below(a, child) && self.is_below(b, child));
            match child {
                Some(child) => meet = child,
                None => return meet,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Separator 0 above separator 1 (leaves 2 and 3) and leaf 4.
    fn lopsided() -> Tree {
        let pair = Tree::above(&Tree::leaf(), &Tree::leaf());
        Tree::above(&pair, &Tree::leaf())
    }

    #[test]
    fn a_vertex_lives_as_deep_as_its_neighbours_allow() {
        let tree = lopsided();
        let home = |labels: &[u32]| tree.home(1, labels.iter().copied());
        assert_eq!(home(&[]), 1);
        assert_eq!(home(&[2, 2]), 2);
        assert_eq!(home(&[1, 3]), 3);
        assert_eq!(home(&[3, 1, 2, 3]), 1);
        assert_eq!(tree.home(0, [2, 4].into_iter()), 0);
    }

    #[test]
    fn leaves_grow_into_trees() {
        let pair = Tree::above(&Tree::leaf(), &Tree::leaf());
        let (tree, numbers) = lopsided().replace_leaves(&[Tree::leaf(), pair, Tree::leaf()]);
        assert_eq!(numbers, [0, 1, 2, 3, 6]);
        assert_eq!(tree.end, [7, 6, 3, 6, 5, 6, 7]);
        assert_eq!((tree.right(0), tree.right(1), tree.right(3)), (6, 3, 5));
    }
}
