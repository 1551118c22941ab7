//! Detection of defects.

use std::cmp::Ordering;
use std::collections::HashSet;

use cotan_geometry::BoundingBox;
use cotan_halfedge::DisjointSets;
use nalgebra::Point3;

use super::{Component, Defect, Inspection};
use crate::attributes::{Attributes, NONE, Values};
use crate::cuts::Cuts;
use crate::document::Document;
use crate::error::IoError;
use crate::faces::FaceList;
use crate::topology::{Side, Topology};

/// Inspects the document.
///
/// `places` are those of the welding, `exact` those of equal positions; either may be empty.
pub(super) fn inspect(
    document: &Document,
    places: &[u32],
    exact: &[u32],
) -> Result<Inspection, IoError> {
    let positions = document.positions();
    let identity: Vec<u32>;
    let places = if places.is_empty() {
        identity = (0..positions.len() as u32).collect();
        &identity
    } else {
        places
    };
    let corners = document.faces().corners().iter();
    let at: Vec<u32> = corners.map(|&v| places[v as usize]).collect();
    let topology = Topology::new(document.faces(), &at);
    let find = Find {
        positions,
        faces: document.faces(),
        places,
        topology,
    };
    let mut inspection = find.counts();
    let (mut inspected, component) = find.components();
    let mut defects = Vec::new();
    find.faces(&mut defects);
    find.edges(&mut defects);
    find.orientation(&component, &mut inspected, &mut defects);
    let mut fans = find.topology.fans();
    find.vertices(&mut fans, &mut defects);
    find.inside_out(&component, &mut inspected, &mut defects);
    find.holes(&mut fans, &mut defects);
    find.lone_vertices(exact, &mut defects);
    match document.attributes() {
        Ok(attributes) => non_finite(&attributes, &mut defects),
        Err(error) => inspection.attributes_problem = Some(error.to_string()),
    }
    // Grouped by kind; the sort is stable within a kind.
    defects.sort_by_key(Defect::kind);
    Ok(Inspection {
        components: inspected,
        defects,
        ..inspection
    })
}

struct Find<'a> {
    positions: &'a [Point3<f64>],
    faces: &'a FaceList,
    /// The place of every vertex.
    places: &'a [u32],
    topology: Topology<'a>,
}

impl Find<'_> {
    fn point(&self, place: u32) -> Point3<f64> {
        self.positions[place as usize]
    }

    fn counts(&self) -> Inspection {
        let mut is_used = vec![false; self.positions.len()];
        for &corner in self.topology.outlines.corners() {
            is_used[self.topology.place(corner) as usize] = true;
        }
        let (mut num_edges, mut num_boundary_edges) = (0, 0);
        let (mut shortest, mut sum, mut longest) = (f64::INFINITY, 0.0, 0.0f64);
        for sides in self.topology.edges() {
            num_edges += 1;
            num_boundary_edges += usize::from(sides.len() == 1);
            let [a, b] = sides[0].ends.map(|place| self.point(place));
            let length = (b - a).norm();
            (shortest, longest) = (shortest.min(length), longest.max(length));
            sum += length;
        }
        let mut places = DisjointSets::new(self.positions.len());
        let boundaries = self.topology.edges().filter(|sides| sides.len() == 1);
        let boundaries = boundaries.map(|sides| sides[0].ends);
        boundaries.clone().for_each(|[a, b]| places.join(a, b));
        Inspection {
            num_vertices: is_used.iter().filter(|used| **used).count(),
            num_faces: self
                .topology
                .outlines
                .iter()
                .filter(|o| !o.is_empty())
                .count(),
            num_edges,
            num_boundary_edges,
            num_boundaries: boundaries
                .map(|[a, _]| places.root(a))
                .collect::<HashSet<_>>()
                .len(),
            edge_lengths: (num_edges > 0).then(|| [shortest, sum / num_edges as f64, longest]),
            components: Vec::new(),
            defects: Vec::new(),
            attributes_problem: None,
        }
    }

    /// The components, and the component index of each face.
    fn components(&self) -> (Vec<Component>, Vec<u32>) {
        let mut sets = self.topology.components();
        let mut numbers = vec![NONE; self.topology.outlines.len()];
        let mut components: Vec<Component> = Vec::new();
        for face in (0..numbers.len()).filter(|&face| self.topology.is_face(face)) {
            let root = sets.root(face as u32) as usize;
            if numbers[root] == NONE {
                numbers[root] = components.len() as u32;
                components.push(Component {
                    first_face: face,
                    num_faces: 0,
                    num_boundary_edges: 0,
                    is_orientable: true,
                    volume: None,
                });
            }
            numbers[face] = numbers[root];
            components[numbers[face] as usize].num_faces += 1;
        }
        for sides in self.topology.edges() {
            if let [side] = sides {
                components[numbers[side.face as usize] as usize].num_boundary_edges += 1;
            }
        }
        (components, numbers)
    }

    fn faces(&self, defects: &mut Vec<Defect>) {
        let cuts = Cuts::new(
            &self.topology,
            self.faces.corners(),
            self.places,
            self.positions,
        );
        let faces = self.topology.outlines.len();
        let mut is_repeating = vec![false; faces];
        cuts.repeating
            .iter()
            .for_each(|&f| is_repeating[f as usize] = true);
        let mut last_face = vec![NONE; self.positions.len()];
        for (face, outline) in self.topology.outlines.iter().enumerate() {
            let corners = self.faces.corner_range(face);
            if outline.len() == corners.len() && !is_repeating[face] {
                continue;
            }
            let places = self.topology.at[corners].iter();
            let mut repeated = places.filter(|&&place| {
                std::mem::replace(&mut last_face[place as usize], face as u32) == face as u32
            });
            if let Some(&vertex) = repeated.next() {
                let vertex = vertex as usize;
                defects.push(Defect::RepeatedVertex { face, vertex });
            }
        }
        let flat = cuts.flat.iter();
        defects.extend(flat.map(|&(face, _)| Defect::ZeroArea {
            face: face as usize,
        }));
        let conflicts = cuts.conflicts(&self.topology).into_iter();
        defects.extend(conflicts.map(|(face, ends)| Defect::CutMeetsEdge {
            face: face as usize,
            vertices: ends.map(|v| v as usize),
        }));
        let duplicates = duplicate_faces(&self.topology).into_iter();
        defects.extend(duplicates.map(|(face, repeats)| Defect::DuplicateFace {
            face: face as usize,
            repeats: repeats as usize,
        }));
    }

    fn edges(&self, defects: &mut Vec<Defect>) {
        for sides in self.topology.edges() {
            let vertices = sides[0].ends.map(|place| place as usize);
            match sides {
                [_] => {}
                [a, b] if a.is_forward != b.is_forward => {}
                [a, b] => defects.push(Defect::InconsistentOrientation {
                    vertices,
                    faces: [a.face as usize, b.face as usize],
                }),
                _ => defects.push(Defect::NonManifoldEdge {
                    vertices,
                    faces: sides.iter().map(|side| side.face as usize).collect(),
                }),
            }
        }
    }

    fn orientation(
        &self,
        component: &[u32],
        components: &mut [Component],
        defects: &mut Vec<Defect>,
    ) {
        let orientation = self.topology.orientation(&self.topology.pairs());
        let mut is_listed = vec![false; orientation.is_orientable.len()];
        for (face, &set) in orientation.component.iter().enumerate() {
            if set == NONE
                || orientation.is_orientable[set as usize]
                || std::mem::replace(&mut is_listed[set as usize], true)
            {
                continue;
            }
            let component = component[face] as usize;
            components[component].is_orientable = false;
            defects.push(Defect::NotOrientable { component, face });
        }
    }

    fn vertices(&self, fans: &mut DisjointSets, defects: &mut Vec<Defect>) {
        let mut num_fans = vec![0usize; self.positions.len()];
        for &corner in self.topology.outlines.corners() {
            let is_first = fans.root(corner) == corner;
            num_fans[self.topology.place(corner) as usize] += usize::from(is_first);
        }
        for (vertex, num_fans) in num_fans.into_iter().enumerate() {
            if num_fans > 1 {
                defects.push(Defect::SeveralFans { vertex, num_fans });
            }
        }
    }

    fn inside_out(
        &self,
        component: &[u32],
        components: &mut [Component],
        defects: &mut Vec<Defect>,
    ) {
        let point = |corner: u32| self.point(self.topology.place(corner));
        let shells = shells(&self.topology, component, components.len(), point);
        for shell in shells {
            let component = shell.component as usize;
            components[component].volume = Some(shell.volume);
            if shell.is_inward && shell.outer.is_none() {
                let face = components[component].first_face;
                defects.push(Defect::InsideOut { component, face });
            }
        }
    }

    fn holes(&self, fans: &mut DisjointSets, defects: &mut Vec<Defect>) {
        for found in self.topology.boundary_loops(fans) {
            let vertices = found
                .corners
                .iter()
                .map(|&c| self.topology.place(c) as usize);
            let length = found.sides.iter().map(|&side| {
                let ends = [side, self.topology.next(side)];
                let [a, b] = ends.map(|corner| self.point(self.topology.place(corner)));
                (b - a).norm()
            });
            defects.push(Defect::Hole {
                vertices: vertices.collect(),
                length: length.sum(),
            });
        }
    }

    fn lone_vertices(&self, exact: &[u32], defects: &mut Vec<Defect>) {
        let is_used = self.faces.used_vertices(self.positions.len());
        for (vertex, &first) in exact.iter().enumerate() {
            let (own, place) = (self.places[vertex], self.places[first as usize]);
            if own as usize == vertex && own != place {
                defects.push(Defect::DuplicateVertex {
                    vertex,
                    repeats: first as usize,
                });
            }
        }
        let unused = (0..is_used.len()).filter(|&vertex| !is_used[vertex]);
        defects.extend(unused.map(|vertex| Defect::UnreferencedVertex { vertex }));
    }
}

/// Finds faces that pass through the same places as an earlier one, in either direction.
///
/// Returns each with the earlier one, in ascending order.
///
/// Two faces that are back to back and have no other neighbour enclose nothing but form a closed
/// surface: neither is a duplicate.
pub(crate) fn duplicate_faces(topology: &Topology<'_>) -> Vec<(u32, u32)> {
    let mut places = Vec::with_capacity(topology.outlines.num_corners());
    let mut ranges = Vec::with_capacity(topology.outlines.len());
    let (mut forward, mut backward) = (Vec::new(), Vec::new());
    for (face, outline) in (0u32..).zip(topology.outlines.iter()) {
        if outline.is_empty() {
            continue;
        }
        forward.clear();
        forward.extend(outline.iter().map(|&corner| topology.place(corner)));
        backward.clear();
        backward.extend(forward.iter().rev());
        for direction in [&mut forward, &mut backward] {
            let first = least_rotation(direction);
            direction.rotate_left(first);
        }
        let start = places.len();
        places.extend_from_slice(forward.as_slice().min(&backward));
        ranges.push((start, places.len(), face));
    }
    let outline = |&(start, end, _): &(usize, usize, u32)| &places[start..end];
    ranges.sort_by(|a, b| outline(a).cmp(outline(b)));
    let mut partners = None;
    let mut duplicates = Vec::new();
    for same in ranges.chunk_by(|a, b| outline(a) == outline(b)) {
        if let [a, _] = same {
            let partners = partners.get_or_insert_with(|| topology.pairs());
            let sides = topology.outlines.get(a.2 as usize).unwrap_or_default();
            let is_closed = sides.iter().all(|&side| {
                let partner = partners[side as usize];
                partner != NONE && topology.agree(side, partner)
            });
            if is_closed {
                continue;
            }
        }
        duplicates.extend(same[1..].iter().map(|&(_, _, face)| (face, same[0].2)));
    }
    duplicates.sort_unstable();
    duplicates
}

/// Returns the start of the lexicographically least rotation of a cyclic sequence.
fn least_rotation(cycle: &[u32]) -> usize {
    let len = cycle.len();
    // Two candidate starts that agree so far. When they differ, the greater one is discarded
    // together with everything that it passed.
    let (mut a, mut b, mut agreeing) = (0, 1, 0);
    while a < len && b < len && agreeing < len {
        match cycle[(a + agreeing) % len].cmp(&cycle[(b + agreeing) % len]) {
            Ordering::Equal => {
                agreeing += 1;
                continue;
            }
            Ordering::Greater => a += agreeing + 1,
            Ordering::Less => b += agreeing + 1,
        }
        if a == b {
            b += 1;
        }
        agreeing = 0;
    }
    a.min(b)
}

/// A closed component with consistently oriented faces.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Shell {
    pub(crate) component: u32,
    pub(crate) volume: f64,
    /// `true` if the volume is negative beyond rounding error.
    pub(crate) is_inward: bool,
    /// The list index of an outermost shell whose bounding box contains this one's.
    pub(crate) outer: Option<usize>,
}

/// The closed, consistently oriented components, given the component of each face.
pub(crate) fn shells(
    topology: &Topology<'_>,
    component: &[u32],
    num_components: usize,
    point: impl Fn(u32) -> Point3<f64>,
) -> Vec<Shell> {
    let mut is_shell = vec![true; num_components];
    let is_closed = |sides: &[Side]| match sides {
        [a, b] => a.is_forward != b.is_forward,
        _ => false,
    };
    for sides in topology.edges().filter(|sides| !is_closed(sides)) {
        for side in sides {
            is_shell[component[side.face as usize] as usize] = false;
        }
    }
    let mut numbers = vec![NONE; num_components];
    let mut shells: Vec<Shell> = Vec::new();
    let mut measures: Vec<(Point3<f64>, f64, BoundingBox<f64>)> = Vec::new();
    for (face, outline) in topology.outlines.iter().enumerate() {
        let Some(&first) = outline.first() else {
            continue;
        };
        let component = component[face];
        if !is_shell[component as usize] {
            continue;
        }
        if numbers[component as usize] == NONE {
            numbers[component as usize] = shells.len() as u32;
            shells.push(Shell {
                component,
                volume: 0.0,
                is_inward: false,
                outer: None,
            });
            let origin = point(first);
            measures.push((
                origin,
                0.0,
                BoundingBox {
                    min: origin,
                    max: origin,
                },
            ));
        }
        let number = numbers[component as usize] as usize;
        let (origin, magnitude, bounds) = &mut measures[number];
        for pair in outline[1..].windows(2) {
            let [a, b, c] = [first, pair[0], pair[1]].map(|corner| point(corner) - *origin);
            let volume = a.dot(&b.cross(&c)) / 6.0;
            shells[number].volume += volume;
            *magnitude += volume.abs();
        }
        for &corner in outline {
            bounds.min = bounds.min.inf(&point(corner));
            bounds.max = bounds.max.sup(&point(corner));
        }
    }
    for (shell, (_, magnitude, _)) in shells.iter_mut().zip(&measures) {
        shell.is_inward = shell.volume < -ROUNDING * magnitude;
    }
    let boxes: Vec<_> = measures.into_iter().map(|(_, _, bounds)| bounds).collect();
    nest(&mut shells, &boxes);
    shells
}

/// Finds the outermost shells, and those inside them.
fn nest(shells: &mut [Shell], boxes: &[BoundingBox<f64>]) {
    let mut order: Vec<usize> = (0..shells.len()).collect();
    let size = |&shell: &usize| boxes[shell].diagonal();
    order.sort_by(|a, b| size(b).total_cmp(&size(a)).then(a.cmp(b)));
    let mut outer: Vec<usize> = Vec::new();
    for shell in order {
        let inner = &boxes[shell];
        let holds = |&&outer: &&usize| {
            let outer = &boxes[outer];
            (0..3).all(|k| outer.min[k] < inner.min[k] && inner.max[k] < outer.max[k])
        };
        shells[shell].outer = outer.iter().find(holds).copied();
        // With thousands of disjoint shells, only the largest are compared with.
        if shells[shell].outer.is_none() && outer.len() < MAX_OUTER {
            outer.push(shell);
        }
    }
}

/// A volume below this fraction of the sum of its parts may be rounding error.
const ROUNDING: f64 = 1e-12;

/// Maximum number of outermost shells that are searched for inner ones.
const MAX_OUTER: usize = 1000;

fn non_finite(attributes: &Attributes, defects: &mut Vec<Defect>) {
    let mut search = |element: &'static str, name: &str, components: usize, values: &Values| {
        let (components, numbers) = match values {
            // Lists are searched item by item, but reported by their element.
            Values::Lists { items, .. } => (0, items.as_ref()),
            values => (components, values),
        };
        let mut last = None;
        each_non_finite(numbers, |index| {
            let number = match values {
                Values::Lists { ends, .. } => ends.partition_point(|&end| end <= index),
                _ => index / components.max(1),
            };
            if last.replace(number) != Some(number) {
                defects.push(Defect::NonFinite {
                    element,
                    property: name.to_owned(),
                    number,
                });
            }
        });
    };
    for p in &attributes.vertices {
        search("vertex", &p.name, p.components, &p.values);
    }
    for p in &attributes.faces {
        search("face", &p.name, p.components, &p.values);
    }
    for p in &attributes.corners {
        search("corner value", &p.name, p.components, &p.values);
    }
}

fn each_non_finite(values: &Values, mut found: impl FnMut(usize)) {
    match values {
        Values::F32(v) => (0..v.len())
            .filter(|&i| !v[i].is_finite())
            .for_each(&mut found),
        Values::F64(v) => (0..v.len())
            .filter(|&i| !v[i].is_finite())
            .for_each(&mut found),
        _ => {}
    }
}
