//! Diagonals that coincide with an edge or a diagonal of another face.

use super::{Cutter, MAX_CORNERS, Polygons, Recuts};

/// The diagonals of all polygons, and the conflicts among them.
pub(super) struct Conflicts {
    /// All diagonals, bucketed by the lower place at their ends: the start of each place's
    /// bucket, and the upper place with the face, in ascending order.
    starts: Vec<u32>,
    diagonals: Vec<(u32, u32)>,
    /// The polygons with a diagonal that another face also has or that ends where it starts, in
    /// ascending order.
    pub(super) faces: Vec<u32>,
}

impl Conflicts {
    /// Finds the conflicts in time proportional to the size of the mesh: diagonals are counted
    /// into buckets, and every side of a face is looked up in one bucket.
    pub(super) fn new(polygons: Polygons<'_>, recuts: &Recuts) -> Self {
        let mut list: Vec<([u32; 2], u32)> = Vec::new();
        let mut cutter = Cutter::new(polygons.positions, polygons.faces.num_corners(), recuts);
        for (face, polygon) in (0u32..).zip(polygons.faces.iter()) {
            if polygons.is_hopeless(polygon) {
                continue;
            }
            cutter.diagonals(face, polygon, |i, j| {
                list.push((polygons.ends(polygon, i, j), face));
            });
        }
        let mut found = Self::sorted(&list, polygons.positions.len());
        found.search(polygons);
        found
    }

    fn sorted(list: &[([u32; 2], u32)], num_places: usize) -> Self {
        let mut starts = vec![0u32; num_places + 1];
        for ([lower, _], _) in list {
            starts[*lower as usize + 1] += 1;
        }
        for place in 0..num_places {
            starts[place + 1] += starts[place];
        }
        let mut next = starts.clone();
        let mut diagonals = vec![(0, 0); list.len()];
        for &([lower, upper], face) in list {
            let at = &mut next[lower as usize];
            diagonals[*at as usize] = (upper, face);
            *at += 1;
        }
        for place in 0..num_places {
            diagonals[starts[place] as usize..starts[place + 1] as usize].sort_unstable();
        }
        Self {
            starts,
            diagonals,
            faces: Vec::new(),
        }
    }

    /// The diagonals from a place to higher ones.
    fn from(&self, place: u32) -> &[(u32, u32)] {
        let place = place as usize;
        &self.diagonals[self.starts[place] as usize..self.starts[place + 1] as usize]
    }

    fn search(&mut self, polygons: Polygons<'_>) {
        let mut faces = Vec::new();
        for place in 0..self.starts.len() as u32 - 1 {
            for same in self.from(place).chunk_by(|a, b| a.0 == b.0) {
                if same.len() > 1 || same[0].0 == place {
                    faces.extend(same.iter().map(|&(_, face)| face));
                }
            }
        }
        for polygon in polygons.faces.iter() {
            for [lower, upper] in polygons.sides(polygon) {
                let from = self.from(lower);
                let start = from.partition_point(|&(place, _)| place < upper);
                let met = from[start..]
                    .iter()
                    .take_while(|&&(place, _)| place == upper);
                faces.extend(met.map(|&(_, face)| face));
            }
        }
        faces.sort_unstable();
        faces.dedup();
        self.faces = faces;
    }

    /// The diagonals, in ascending order, of polygons with many corners for which both ends are
    /// near.
    pub(super) fn near_large(
        &self,
        polygons: Polygons<'_>,
        is_near: impl Fn(&[u32; 2]) -> bool,
    ) -> Vec<[u32; 2]> {
        let mut near = Vec::new();
        for lower in 0..self.starts.len() as u32 - 1 {
            let of_large = |&&(_, face): &&(u32, u32)| polygons.polygon(face).len() > MAX_CORNERS;
            let from = self.from(lower).iter().filter(of_large);
            near.extend(from.map(|&(upper, _)| [lower, upper]).filter(&is_near));
        }
        near.dedup();
        near
    }
}
