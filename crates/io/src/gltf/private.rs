//! Detection of accessors that do not share their bytes, so that these may be changed in place.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ops::Range;

use super::GltfFile;
use super::accessor::{Layout, Span};
use super::tokens::{Token, Tokens};

/// The use of an accessor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Role {
    Position,
    /// The normals of the vertices with this POSITION accessor.
    Normal(u64),
    Other,
}

/// The accessors that share neither their bytes nor themselves with anything else.
#[derive(Debug)]
pub(super) struct Private {
    roles: HashMap<u64, Role>,
    overlapping: HashSet<u64>,
}

impl Private {
    pub(super) fn new(file: &GltfFile) -> Self {
        Self {
            roles: roles(file),
            overlapping: overlapping(file),
        }
    }

    /// Returns `true` if the accessor is used only for positions.
    pub(super) fn position(&self, accessor: usize) -> bool {
        self.is(accessor, Role::Position)
    }

    /// Returns `true` if the accessor is used only for the normals of the vertices of `position`.
    pub(super) fn normal(&self, accessor: usize, position: usize) -> bool {
        self.is(accessor, Role::Normal(position as u64))
    }

    fn is(&self, accessor: usize, role: Role) -> bool {
        let accessor = accessor as u64;
        self.roles.get(&accessor) == Some(&role) && !self.overlapping.contains(&accessor)
    }
}

fn roles(file: &GltfFile) -> HashMap<u64, Role> {
    let mut roles = HashMap::new();
    let mut note = |accessor: u64, role: Role| {
        let old = *roles.entry(accessor).or_insert(role);
        if old != role {
            roles.insert(accessor, Role::Other);
        }
    };
    for primitive in file.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        let position = primitive.attributes.get("POSITION").copied();
        for (semantic, &accessor) in &primitive.attributes {
            let role = match (semantic.as_str(), position) {
                ("POSITION", _) => Role::Position,
                ("NORMAL", Some(position)) => Role::Normal(position),
                _ => Role::Other,
            };
            note(accessor, role);
        }
        let targets = primitive.targets.iter().flat_map(|target| target.values());
        for &accessor in targets.chain(&primitive.indices) {
            note(accessor, Role::Other);
        }
    }
    for &accessor in &file.other_uses {
        note(accessor, Role::Other);
    }
    for number in numbers_in_extensions(file.text()) {
        if number < file.accessors.len() as u64 {
            note(number, Role::Other);
        }
    }
    roles
}

/// The integers in the data of extensions.
///
/// Any of them may be an accessor index, for example of the translations of
/// `EXT_mesh_gpu_instancing`. Extensions that describe materials, lights or the compression of
/// data are excluded.
fn numbers_in_extensions(text: &str) -> BTreeSet<u64> {
    const OTHERS: [&str; 11] = [
        "KHR_materials_",
        "EXT_materials_",
        "KHR_texture_",
        "EXT_texture_",
        "MSFT_texture_",
        "KHR_lights_",
        "EXT_lights_",
        "KHR_draco_mesh_compression",
        "KHR_meshopt_compression",
        "EXT_meshopt_compression",
        "KHR_mesh_quantization",
    ];
    let mut numbers = BTreeSet::new();
    let mut tokens = Tokens::new(text);
    let mut depth = 0usize;
    // The depth of the object that contains extensions.
    let mut within: Option<usize> = None;
    let mut starts = false;
    while let Some(token) = tokens.next() {
        let is_start = std::mem::take(&mut starts);
        match token {
            Token::Open => {
                if is_start && within.is_none() {
                    within = Some(depth);
                }
                depth += 1;
            }
            Token::Close => {
                depth = depth.saturating_sub(1);
                within = within.filter(|&outer| outer < depth);
            }
            Token::Key(_) => {
                let key = token.string().unwrap_or_default();
                let is_name = within.is_some_and(|outer| outer + 1 == depth);
                if key == "extras" || is_name && OTHERS.iter().any(|other| key.starts_with(other)) {
                    tokens.skip_value();
                } else {
                    starts = key == "extensions";
                }
            }
            Token::Word(word) if within.is_some() => numbers.extend(word.parse::<u64>()),
            Token::Word(_) | Token::Text(_) => {}
        }
    }
    numbers
}

/// A range of bytes in use.
struct Use {
    buffer: usize,
    range: Range<usize>,
    /// Stride and size of the elements of an accessor; if `None`, the whole range is used.
    elements: Option<(usize, usize)>,
    accessor: Option<u64>,
}

fn overlapping(file: &GltfFile) -> HashSet<u64> {
    let mut uses = uses(file);
    uses.sort_by_key(|u| (u.buffer, u.range.start));
    let mut shared = HashSet::new();
    // Ranges that overlap, directly or through others, form a run.
    let mut start = 0;
    while let Some(first) = uses.get(start) {
        let mut run_end = first.range.end;
        let mut end = start + 1;
        while let Some(next) = uses.get(end) {
            if next.buffer != first.buffer || next.range.start >= run_end {
                break;
            }
            run_end = run_end.max(next.range.end);
            end += 1;
        }
        let run = &uses[start..end];
        if run.len() > 1 && !is_interleaved(run) {
            shared.extend(run.iter().filter_map(|u| u.accessor));
        }
        start = end;
    }
    shared
}

/// Returns `true` if all uses are interleaved elements that do not overlap.
fn is_interleaved(run: &[Use]) -> bool {
    let stride = run
        .first()
        .and_then(|u| u.elements)
        .map(|(stride, _)| stride);
    let Some(stride) = stride.filter(|&stride| stride > 0) else {
        return false;
    };
    let mut phases = Vec::with_capacity(run.len());
    for u in run {
        match u.elements {
            Some((other, size)) if other == stride => phases.push((u.range.start % stride, size)),
            _ => return false,
        }
    }
    phases.sort_unstable();
    // The first one again after the last.
    let next = phases.iter().skip(1).map(|&(phase, _)| phase);
    let again = phases.first().map(|&(phase, _)| phase + stride);
    phases
        .iter()
        .zip(next.chain(again))
        .all(|(&(phase, size), next)| phase + size <= next)
}

fn uses(file: &GltfFile) -> Vec<Use> {
    let mut uses = Vec::new();
    let mut is_used = vec![false; file.views.len()];
    let mut elements = |span: &Span, accessor: u64| {
        if span.count > 0 {
            uses.push(Use {
                buffer: span.buffer,
                range: span.start..span.end(),
                elements: Some((span.stride, span.size)),
                accessor: Some(accessor),
            });
        }
    };
    let mut whole: Vec<u64> = file.images.clone();
    for (number, accessor) in file.accessors.iter().enumerate() {
        let number = number as u64;
        match Layout::new(number, &file.accessors, &file.views, &file.buffers) {
            Ok(layout) => {
                if let Some(span) = &layout.base {
                    elements(span, number);
                    let view = accessor.view.and_then(|view| usize::try_from(view).ok());
                    if let Some(is_used) = view.and_then(|view| is_used.get_mut(view)) {
                        *is_used = true;
                    }
                }
            }
            // An unknown kind of accessor may use the whole view.
            Err(_) => whole.extend(accessor.view),
        }
        if let Some(sparse) = &accessor.sparse {
            whole.extend([sparse.indices.view, sparse.values.view]);
        }
    }
    // Views that no accessor uses belong to an extension.
    let unused = is_used.iter().enumerate().filter(|&(_, &is_used)| !is_used);
    whole.extend(unused.map(|(view, _)| view as u64));
    // A compressed copy of a view would no longer match it.
    let views = file.views.iter().enumerate();
    let extended = views.filter(|(_, view)| !view.extensions.is_empty());
    whole.extend(extended.map(|(view, _)| view as u64));
    whole.sort_unstable();
    whole.dedup();
    for view in whole {
        let view = usize::try_from(view)
            .ok()
            .and_then(|view| file.views.get(view));
        let range = view.and_then(|view| {
            let start = usize::try_from(view.offset).ok()?;
            let end = start.checked_add(usize::try_from(view.length).ok()?)?;
            Some((usize::try_from(view.buffer).ok()?, start..end))
        });
        if let Some((buffer, range)) = range.filter(|(_, range)| !range.is_empty()) {
            uses.push(Use {
                buffer,
                range,
                elements: None,
                accessor: None,
            });
        }
    }
    uses
}
