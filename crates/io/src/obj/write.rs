//! A new OBJ file, with the attributes that OBJ can represent.
//!
//! Colours and weights follow the positions (a vertex with a colour has no room for a weight).
//! Normals and texture coordinates of corners, or else of vertices, become `vn` and `vt`. Names
//! become `o`, `g`, `usemtl` and `s` before the faces that have them. A face without a name after
//! one with a name is preceded by `g` or `o` alone, `usemtl (null)` or `s off`. Known materials
//! go into a separate library. 64-bit and 32-bit numbers are written as the shortest that parse
//! back to the same bits; integer colours become fractions of the type's maximum.

use crate::attributes::{
    Attributes, COLOR, CornerProperty, LabelKind, Labels, NONE, NORMAL, Property, UV, Values,
};
use crate::contents::{Contents, lost_properties};
use crate::faces::FaceList;
use crate::number;
use crate::obj::decode::{KINDS, WEIGHT, no_name};
use crate::obj::mtl::material_names;

/// Writes the file as text, with 1-based indices.
///
/// `library` is the file of its materials, if one is created for it.
pub(super) fn write(contents: &Contents<'_>, library: Option<&str>) -> String {
    let attributes = contents.attributes.as_ref();
    let mut plan = Plan::new(attributes);
    plan.material_names = material_names(&contents.materials);
    let mut out = String::new();
    for comment in &attributes.comments {
        for line in comment.split(['\n', '\r']) {
            out.push_str(if line.is_empty() { "#" } else { "# " });
            out.push_str(line);
            out.push('\n');
        }
    }
    match library {
        Some(library) => statement(&mut out, "mtllib", library),
        None => {
            for library in &attributes.libraries {
                statement(&mut out, "mtllib", library);
            }
        }
    }
    for (vertex, p) in contents.positions.iter().enumerate() {
        out.push('v');
        p.iter().for_each(|&x| push(&mut out, x));
        if let Some(p) = plan.color {
            row(&mut out, &p.values, vertex, p.components, push_color);
        } else if let Some(p) = plan.weight {
            row(&mut out, &p.values, vertex, 1, push_number);
        }
        out.push('\n');
    }
    for (keyword, table) in [("vt", &plan.textures), ("vn", &plan.normals)] {
        if let Some(table) = table {
            for entry in 0..table.values.len() / table.components {
                out.push_str(keyword);
                row(&mut out, table.values, entry, table.components, push_number);
                out.push('\n');
            }
        }
    }
    write_faces(&mut out, &contents.faces, &plan);
    out
}

/// Lists what a new OBJ file cannot represent.
pub(super) fn losses(attributes: &Attributes) -> Vec<String> {
    let plan = Plan::new(attributes);
    let has_table = |name: &str, table: &Option<Table<'_>>| {
        attributes.corner(name).is_none() && table.is_some()
    };
    let vertices = attributes.vertices.iter().filter(|p| {
        let is = |kept: Option<&Property>| kept.is_some_and(|kept| std::ptr::eq(kept, *p));
        let is_table = (p.name == NORMAL && has_table(NORMAL, &plan.normals))
            || (p.name == UV && has_table(UV, &plan.textures));
        !(is(plan.color) || is(plan.weight) || is_table)
    });
    let corners = attributes.corners.iter().filter(|p| {
        let is = |table: &Option<Table<'_>>| {
            let table = table.as_ref();
            table.is_some_and(|table| std::ptr::eq(table.values, &p.values))
        };
        !(is(&plan.textures) || is(&plan.normals))
    });
    let mut losses = lost_properties(vertices, attributes.faces.iter(), corners);
    let others = attributes.labels.iter();
    let others = others.filter(|l| !plan.labels.iter().any(|kept| std::ptr::eq(kept.labels, *l)));
    match others.count() {
        0 => {}
        n => losses.push(format!("{n} further lists of names of faces")),
    }
    losses
}

/// The destination of each attribute.
struct Plan<'a> {
    color: Option<&'a Property>,
    weight: Option<&'a Property>,
    textures: Option<Table<'a>>,
    normals: Option<Table<'a>>,
    labels: Vec<State<'a>>,
    /// The names of the known materials, as in the library.
    material_names: Vec<String>,
}

/// Values that corners refer to.
struct Table<'a> {
    values: &'a Values,
    components: usize,
    /// The entry of each corner; `None` if it is that of its vertex.
    indices: Option<&'a [u32]>,
}

/// Names of one kind, and the keyword that sets them.
struct State<'a> {
    labels: &'a Labels,
    keyword: &'static str,
}

impl<'a> Plan<'a> {
    fn new(attributes: &'a Attributes) -> Self {
        let is_list = |values: &Values| matches!(values, Values::Lists { .. });
        let vertex = |name: &str, components: [usize; 3]| {
            let property = attributes.vertex(name)?;
            let fits = components.contains(&property.components) && !is_list(&property.values);
            fits.then_some(property)
        };
        let table = |name: &str, components: [usize; 3]| {
            let corner = |p: &'a CornerProperty| Table {
                values: &p.values,
                components: p.components,
                indices: Some(&p.indices),
            };
            let property = attributes.corner(name);
            let property = property.filter(|p| components.contains(&p.components));
            property.map(corner).or_else(|| {
                let p = vertex(name, components)?;
                Some(Table {
                    values: &p.values,
                    components: p.components,
                    indices: None,
                })
            })
        };
        let color = vertex(COLOR, [3, 4, 4]);
        let labels = KINDS.iter().filter_map(|&(kind, keyword)| {
            Some(State {
                labels: attributes.label(kind)?,
                keyword,
            })
        });
        Self {
            color,
            weight: vertex(WEIGHT, [1; 3]).filter(|_| color.is_none()),
            textures: table(UV, [1, 2, 3]),
            normals: table(NORMAL, [3; 3]),
            labels: labels.collect(),
            material_names: Vec::new(),
        }
    }
}

fn write_faces(out: &mut String, faces: &FaceList, plan: &Plan<'_>) {
    let mut states = vec![NONE; plan.labels.len()];
    let mut corner = 0;
    for (face, polygon) in faces.iter().enumerate() {
        for (state, current) in plan.labels.iter().zip(&mut states) {
            let label = state.labels.faces.get(face).copied().unwrap_or(NONE);
            if label != *current {
                *current = label;
                let known = match state.labels.kind {
                    LabelKind::Material => plan.material_names.get(label as usize),
                    _ => None,
                };
                let name = known.or_else(|| state.labels.names.get(label as usize));
                let name = name.map_or(no_name(state.labels.kind), String::as_str);
                statement(out, state.keyword, name);
            }
        }
        out.push('f');
        for &v in polygon {
            let entry = |table: &Option<Table<'_>>| {
                let table = table.as_ref()?;
                let entry = match table.indices {
                    Some(indices) => indices.get(corner).copied()?,
                    None => v,
                };
                (entry != NONE).then_some(entry)
            };
            push_corner(out, v, entry(&plan.textures), entry(&plan.normals));
            corner += 1;
        }
        out.push('\n');
    }
}

/// Appends a space and a corner.
pub(super) fn push_corner(
    out: &mut String,
    vertex: u32,
    texture: Option<u32>,
    normal: Option<u32>,
) {
    let mut number = |mark: &str, index: u32| {
        out.push_str(mark);
        number::push_integer(out, u64::from(index) + 1);
    };
    number(" ", vertex);
    match (texture, normal) {
        (None, None) => {}
        (Some(texture), None) => number("/", texture),
        (None, Some(normal)) => number("//", normal),
        (Some(texture), Some(normal)) => {
            number("/", texture);
            number("/", normal);
        }
    }
}

/// Appends a keyword and a name, which may contain anything except line endings.
fn statement(out: &mut String, keyword: &str, name: &str) {
    out.push_str(keyword);
    let name = name.trim_matches(|c: char| c <= ' ');
    if !name.is_empty() {
        out.push(' ');
        out.extend(
            name.chars()
                .map(|c| if matches!(c, '\n' | '\r') { ' ' } else { c }),
        );
    }
    if name.ends_with('\\') {
        // The next line would continue this one.
        out.push(' ');
    }
    out.push('\n');
}

/// Appends the numbers of one element, each after a space.
fn row(
    out: &mut String,
    values: &Values,
    element: usize,
    components: usize,
    push: impl Fn(&mut String, &Values, usize),
) {
    for k in 0..components {
        push(out, values, element * components + k);
    }
}

fn push(out: &mut String, x: f64) {
    out.push(' ');
    number::push_f64(out, x);
}

/// Appends a number unchanged.
fn push_number(out: &mut String, values: &Values, index: usize) {
    match values {
        Values::F32(v) => {
            out.push(' ');
            number::push_f32(out, v.get(index).copied().unwrap_or_default());
        }
        _ => push(out, values.get(index).unwrap_or_default()),
    }
}

/// Appends a component of a colour, scaled to 0 to 1.
fn push_color(out: &mut String, values: &Values, index: usize) {
    let largest = match values {
        Values::F32(_) | Values::F64(_) | Values::Lists { .. } => {
            return push_number(out, values, index);
        }
        integers => integers.unit(),
    };
    let x: f64 = values.get(index).unwrap_or_default() / largest;
    match values {
        // As many digits as distinguish 16-bit values.
        Values::I8(_) | Values::U8(_) | Values::I16(_) | Values::U16(_) => {
            out.push(' ');
            number::push_f32(out, x as f32);
        }
        _ => push(out, x),
    }
}
