//! The parts that drive, and the order in which the others follow.

use super::proximity::Link;

/// The role of a part.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Role {
    /// It has handles, or lies between parts with handles: it is solved.
    Drives,
    /// It follows parts that are placed before it.
    Follows,
    /// It stays where it is.
    Still,
}

/// The roles of all parts.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Roles {
    pub(crate) roles: Vec<Role>,
    /// The layer of each part: 0 for drivers, then by the order in which parts are placed.
    /// [`UNPLACED`] for parts that are still.
    pub(crate) layers: Vec<u32>,
}

/// The layer of parts that are still.
pub(crate) const UNPLACED: u32 = u32::MAX;

impl Roles {
    /// Assigns the roles of parts with these links. `has_handle` and `counts` tell which parts
    /// have handles and which may follow. Links longer than `longest` make no part drive.
    pub(crate) fn new(has_handle: &[bool], counts: &[bool], links: &[Link], longest: f64) -> Self {
        let n = has_handle.len();
        let mut layers = vec![UNPLACED; n];
        let between = between(has_handle, links, longest);
        for p in 0..n {
            if has_handle[p] || between[p] {
                layers[p] = 0;
            }
        }
        let neighbours = neighbours(n, links);
        let mut layer = 0;
        let mut front: Vec<u32> = (0..n as u32).filter(|p| layers[*p as usize] == 0).collect();
        let num_active = counts.iter().filter(|counts| **counts).count();
        let mut num_placed = front.len();
        while num_placed < num_active {
            layer += 1;
            let mut next = Vec::new();
            for &p in &front {
                for &(q, k) in &neighbours[p as usize] {
                    let link = &links[k as usize];
                    let sees = link.sees[usize::from(q == link.parts[1])];
                    if sees && layers[q as usize] == UNPLACED && counts[q as usize] {
                        layers[q as usize] = layer;
                        next.push(q);
                    }
                }
            }
            if next.is_empty() {
                next = nearest_of_the_rest(&mut layers, counts, links, layer);
            }
            if next.is_empty() {
                break;
            }
            num_placed += next.len();
            front = next;
        }
        let role = |layer: &u32| match *layer {
            0 => Role::Drives,
            UNPLACED => Role::Still,
            _ => Role::Follows,
        };
        Self {
            roles: layers.iter().map(role).collect(),
            layers,
        }
    }

    /// The parts with this role, ascending.
    pub(crate) fn with(&self, role: Role) -> impl Iterator<Item = usize> {
        let roles = self.roles.iter().enumerate();
        roles.filter(move |(_, r)| **r == role).map(|(p, _)| p)
    }
}

/// Places the parts that are nearest to a placed one. Needed if none of the remaining parts has a
/// placed one among its own nearest.
fn nearest_of_the_rest(
    layers: &mut [u32],
    counts: &[bool],
    links: &[Link],
    layer: u32,
) -> Vec<u32> {
    /// Distances whose relative difference is smaller than this differ only by rounding.
    const ROUNDING: f64 = 1e-9;
    let next = |link: &Link| {
        let [a, b] = link.parts;
        let is_placed = |p: u32| layers[p as usize] != UNPLACED;
        let follower = match (is_placed(a), is_placed(b)) {
            (true, false) => b,
            (false, true) => a,
            _ => return None,
        };
        counts[follower as usize].then_some((follower, link.distance))
    };
    let open: Vec<(u32, f64)> = links.iter().filter_map(next).collect();
    let least = open.iter().map(|(_, d)| *d).fold(f64::INFINITY, f64::min);
    let mut placed: Vec<u32> = open
        .into_iter()
        .filter(|(_, d)| *d <= least * (1.0 + ROUNDING))
        .map(|(p, _)| p)
        .collect();
    placed.sort_unstable();
    placed.dedup();
    placed.iter().for_each(|p| layers[*p as usize] = layer);
    placed
}

fn neighbours(n: usize, links: &[Link]) -> Vec<Vec<(u32, u32)>> {
    let mut neighbours = vec![Vec::new(); n];
    for (k, link) in links.iter().enumerate() {
        let [a, b] = link.parts;
        neighbours[a as usize].push((b, k as u32));
        neighbours[b as usize].push((a, k as u32));
    }
    neighbours
}

/// The parts in those biconnected blocks of the links that lie on paths between parts with
/// handles.
///
/// In the tree of parts and blocks, leaves without handles are cut off until none is left.
fn between(has_handle: &[bool], links: &[Link], longest: f64) -> Vec<bool> {
    let n = has_handle.len();
    let near: Vec<Link> = links
        .iter()
        .copied()
        .filter(|l| l.distance <= longest)
        .collect();
    let blocks = blocks(n, &near);
    let mut blocks_of = vec![Vec::new(); n];
    for (b, block) in blocks.iter().enumerate() {
        block.iter().for_each(|p| blocks_of[*p as usize].push(b));
    }
    let mut of_part: Vec<usize> = blocks_of.iter().map(Vec::len).collect();
    let mut of_block: Vec<usize> = blocks.iter().map(Vec::len).collect();
    let mut is_cut = vec![false; n];
    let mut is_gone = vec![false; blocks.len()];
    let mut open: Vec<usize> = (0..n)
        .filter(|p| !has_handle[*p] && of_part[*p] <= 1)
        .collect();
    while let Some(p) = open.pop() {
        if std::mem::replace(&mut is_cut[p], true) {
            continue;
        }
        for &b in &blocks_of[p] {
            if is_gone[b] {
                continue;
            }
            of_block[b] -= 1;
            if of_block[b] <= 1 {
                is_gone[b] = true;
                for &q in &blocks[b] {
                    let q = q as usize;
                    of_part[q] -= 1;
                    if !is_cut[q] && !has_handle[q] && of_part[q] <= 1 {
                        open.push(q);
                    }
                }
            }
        }
    }
    let mut is_between = vec![false; n];
    for (block, _) in blocks.iter().zip(&is_gone).filter(|(_, gone)| !**gone) {
        block.iter().for_each(|p| is_between[*p as usize] = true);
    }
    is_between
}

/// The biconnected blocks of a graph, as sets of its nodes.
///
/// **Source**: Hopcroft and Tarjan 1973, without recursion: chains of parts may be long.
fn blocks(n: usize, links: &[Link]) -> Vec<Vec<u32>> {
    const UNSEEN: u32 = u32::MAX;
    let neighbours = neighbours(n, links);
    let mut depth = vec![UNSEEN; n];
    let mut low = vec![UNSEEN; n];
    let mut blocks = Vec::new();
    let mut edges: Vec<[u32; 2]> = Vec::new();
    for root in 0..n as u32 {
        if depth[root as usize] != UNSEEN {
            continue;
        }
        depth[root as usize] = 0;
        low[root as usize] = 0;
        // A node, the link by which it was reached, and the next neighbour to visit.
        let mut stack: Vec<(u32, u32, usize)> = vec![(root, UNSEEN, 0)];
        while let Some((p, by, next)) = stack.last_mut() {
            let (p, by) = (*p, *by);
            if let Some(&(q, link)) = neighbours[p as usize].get(*next) {
                *next += 1;
                if link == by {
                    continue;
                }
                if depth[q as usize] == UNSEEN {
                    edges.push([p, q]);
                    depth[q as usize] = depth[p as usize] + 1;
                    low[q as usize] = depth[q as usize];
                    stack.push((q, link, 0));
                } else if depth[q as usize] < depth[p as usize] {
                    edges.push([p, q]);
                    low[p as usize] = low[p as usize].min(depth[q as usize]);
                }
                continue;
            }
            stack.pop();
            let Some(&(above, ..)) = stack.last() else {
                continue;
            };
            low[above as usize] = low[above as usize].min(low[p as usize]);
            if low[p as usize] >= depth[above as usize] {
                let mut block = Vec::new();
                while let Some(edge) = edges.pop() {
                    block.extend(edge);
                    if edge == [above, p] {
                        break;
                    }
                }
                block.sort_unstable();
                block.dedup();
                blocks.push(block);
            }
        }
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    fn links(pairs: &[[u32; 2]]) -> Vec<Link> {
        let link = |parts: &[u32; 2]| Link {
            parts: *parts,
            distance: 0.0,
            sees: [true; 2],
        };
        pairs.iter().map(link).collect()
    }

    /// A chain 0-1-2-3 with a triangle 2-4-5 and a leaf 6 at 1.
    #[test]
    fn parts_on_the_way_between_handles_drive_and_the_others_follow_in_layers() {
        let links = links(&[[0, 1], [1, 2], [2, 3], [2, 4], [4, 5], [2, 5], [1, 6]]);
        let has = |held: &[usize]| (0..7).map(|p| held.contains(&p)).collect::<Vec<_>>();
        let roles = Roles::new(&has(&[0, 3]), &[true; 7], &links, 1.0);
        assert_eq!(roles.layers, [0, 0, 0, 0, 1, 1, 1]);
        let roles = Roles::new(&has(&[1, 5]), &[true; 7], &links, 1.0);
        assert_eq!(roles.layers, [1, 0, 0, 1, 0, 0, 1]);
        let roles = Roles::new(&has(&[0]), &[true; 7], &links, 1.0);
        assert_eq!(roles.layers, [0, 1, 2, 3, 3, 3, 2]);
        let mut counts = [true; 7];
        counts[6] = false;
        let roles = Roles::new(&has(&[3]), &counts, &links, 1.0);
        assert_eq!(roles.layers, [3, 2, 1, 0, 2, 2, UNPLACED]);
        assert_eq!(roles.with(Role::Still).collect::<Vec<_>>(), [6]);
    }

    #[test]
    fn a_long_chain_needs_no_deep_stack() {
        let n = 100_000;
        let chain: Vec<[u32; 2]> = (1..n).map(|p| [p - 1, p]).collect();
        let mut held = vec![false; n as usize];
        (held[0], held[n as usize - 1]) = (true, true);
        let roles = Roles::new(&held, &vec![true; n as usize], &links(&chain), 1.0);
        assert!(roles.layers.iter().all(|layer| *layer == 0));
    }
}
