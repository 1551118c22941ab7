//! Decoding of the attributes of an OBJ file from its text, on request.
//!
//! - A vertex with six numbers has a colour after its position, one with seven a colour with
//!   alpha. With four or five numbers, the fourth is its weight. A colour or weight that is not
//!   finite is ignored (some programs write `nan` for missing values). If only some vertices have
//!   a colour, the others are white; if only some have a weight, it is 1 for the others.
//! - `vt` and `vn` are tables that corners refer to; components that a `vt` omits are 0.
//! - `g`, `o`, `usemtl` and `s` label the faces that follow. Names extend to the end of the line.
//!   Without a name, and after `s off`, `s 0` and `usemtl (null)`, faces have no label.

use std::collections::HashMap;

use crate::attributes::{
    Attributes, COLOR, CornerProperty, LabelKind, Labels, NONE, NORMAL, Property, UV, Values,
};
use crate::error::{Element, IoError, Place, quote};
use crate::number;
use crate::obj::ObjFile;
use crate::obj::statement::{CORNER, Statement, Statements, corner, decode, resolve};
use crate::room;
use crate::source::Mesh;
use crate::text::{self, Tokens};

/// Name of the property that holds the fourth number of the vertices.
pub(super) const WEIGHT: &str = "weight";

/// The kinds of labels, in the order in which they are decoded and written.
pub(super) const KINDS: [(LabelKind, &str); 4] = [
    (LabelKind::Object, "o"),
    (LabelKind::Group, "g"),
    (LabelKind::Material, "usemtl"),
    (LabelKind::Smoothing, "s"),
];

/// The argument that clears the label of this kind.
pub(super) fn no_name(kind: LabelKind) -> &'static str {
    match kind {
        LabelKind::Smoothing => "off",
        // Some readers reject the line without a name.
        LabelKind::Material => "(null)",
        _ => "",
    }
}

/// Decodes all contents of the file other than positions and faces.
pub(super) fn attributes(file: &ObjFile, mesh: Mesh<'_>) -> Result<Attributes, IoError> {
    let mut decoder = Decoder::new(file, mesh);
    let start = text::after_bom(&file.bytes);
    for statement in Statements::new(&file.bytes, start, 0) {
        decoder.statement(&statement)?;
    }
    Ok(decoder.finish())
}

/// The argument of each `mtllib`.
pub(super) fn libraries(file: &ObjFile) -> Vec<String> {
    let start = text::after_bom(&file.bytes);
    Statements::new(&file.bytes, start, 0)
        .filter(|statement| statement.keyword() == b"mtllib")
        .map(|statement| decode(statement.name()))
        .collect()
}

/// The table entries that corners refer to: for texture coordinates and normals, the index for
/// each corner.
pub(super) fn corner_references(
    file: &ObjFile,
    mesh: Mesh<'_>,
) -> Result<[Option<Vec<u32>>; 2], IoError> {
    let mut decoder = Decoder::new(file, mesh);
    let start = text::after_bom(&file.bytes);
    for statement in Statements::new(&file.bytes, start, 0) {
        match statement.keyword() {
            b"vt" => decoder.textures.count += 1,
            b"vn" => decoder.normals.count += 1,
            b"f" => decoder.face(&statement)?,
            _ => {}
        }
    }
    Ok([decoder.textures, decoder.normals].map(|table| (table.total > 0).then_some(table.indices)))
}

/// The label of every face, as written in the file, in the order of [`KINDS`].
pub(super) fn raw_labels(file: &ObjFile) -> Result<[RawLabels<'_>; 4], IoError> {
    let mut labels = KINDS.map(|(kind, _)| RawLabels::new(kind));
    let start = text::after_bom(&file.bytes);
    for statement in Statements::new(&file.bytes, start, 0) {
        match statement.keyword() {
            b"f" => labels.iter_mut().try_for_each(RawLabels::face)?,
            word => RawLabels::set(&mut labels, word, &statement),
        }
    }
    Ok(labels)
}

/// Names of one kind, and the faces that have them.
pub(super) struct RawLabels<'a> {
    kind: LabelKind,
    pub(super) names: Vec<&'a [u8]>,
    /// For each face, the index of its name, or [`NONE`].
    pub(super) faces: Vec<u32>,
    numbers: HashMap<&'a [u8], u32>,
    current: Current<'a>,
}

/// The name of the faces that follow. A name gets its index at its first face.
enum Current<'a> {
    Name(&'a [u8]),
    Number(u32),
}

impl<'a> RawLabels<'a> {
    fn new(kind: LabelKind) -> Self {
        Self {
            kind,
            names: Vec::new(),
            faces: Vec::new(),
            numbers: HashMap::new(),
            current: Current::Number(NONE),
        }
    }

    /// Processes a statement that may set one of the labels.
    fn set(labels: &mut [Self; 4], keyword: &[u8], statement: &Statement<'a>) {
        let kind = KINDS
            .iter()
            .position(|(_, word)| word.as_bytes() == keyword);
        let Some(label) = kind.and_then(|kind| labels.get_mut(kind)) else {
            return;
        };
        let name = statement.name();
        let is_none = name.is_empty()
            || name == no_name(label.kind).as_bytes()
            || (label.kind == LabelKind::Smoothing && name == b"0");
        label.current = if is_none {
            Current::Number(NONE)
        } else {
            Current::Name(name)
        };
    }

    fn face(&mut self) -> Result<(), IoError> {
        let number = match self.current {
            Current::Number(number) => number,
            Current::Name(name) => *self.numbers.entry(name).or_insert_with(|| {
                self.names.push(name);
                self.names.len() as u32 - 1
            }),
        };
        self.current = Current::Number(number);
        room::push(&mut self.faces, number)
    }

    /// Returns `None` if no face has a name.
    fn finish(self) -> Option<Labels> {
        (!self.names.is_empty()).then(|| Labels {
            kind: self.kind,
            names: self.names.into_iter().map(decode).collect(),
            faces: self.faces,
        })
    }
}

/// Values that corners refer to.
#[derive(Default)]
struct Table {
    values: Vec<f64>,
    /// The number of entries so far.
    count: usize,
    /// The number of entries in the file.
    total: usize,
    indices: Vec<u32>,
}

struct Decoder<'a> {
    mesh: Mesh<'a>,
    vertex: usize,
    face: usize,
    /// Red, green, blue and alpha; empty up to the first vertex with a colour.
    colors: Vec<[f64; 4]>,
    has_alpha: bool,
    /// Empty up to the first vertex with a weight.
    weights: Vec<f64>,
    /// Three numbers per entry.
    textures: Table,
    /// The maximum number of components of a `vt`.
    texture_components: usize,
    normals: Table,
    labels: [RawLabels<'a>; 4],
    comments: Vec<String>,
    libraries: Vec<String>,
}

impl<'a> Decoder<'a> {
    fn new(file: &'a ObjFile, mesh: Mesh<'a>) -> Self {
        let table = |total| Table {
            total,
            ..Table::default()
        };
        Self {
            mesh,
            vertex: 0,
            face: 0,
            colors: Vec::new(),
            has_alpha: false,
            weights: Vec::new(),
            textures: table(file.counts.textures()),
            texture_components: 1,
            normals: table(file.counts.normals()),
            labels: KINDS.map(|(kind, _)| RawLabels::new(kind)),
            comments: Vec::new(),
            libraries: Vec::new(),
        }
    }

    fn statement(&mut self, statement: &Statement<'a>) -> Result<(), IoError> {
        match statement.keyword() {
            b"v" => self.vertex(statement)?,
            b"vt" => self.texture(statement)?,
            b"vn" => self.normal(statement)?,
            b"f" => {
                self.labels.iter_mut().try_for_each(RawLabels::face)?;
                self.face(statement)?;
            }
            b"mtllib" => {
                self.libraries.push(decode(statement.name()));
                return Ok(());
            }
            word @ (b"o" | b"g" | b"usemtl" | b"s") => {
                RawLabels::set(&mut self.labels, word, statement);
                return Ok(());
            }
            _ => {}
        }
        self.comments.extend(statement.comment().map(decode));
        Ok(())
    }

    fn vertex(&mut self, statement: &Statement<'_>) -> Result<(), IoError> {
        let mut tokens = statement.arguments();
        tokens.nth(2);
        let (numbers, count) = numbers::<4>(&mut tokens, statement.line, || {
            Element::new("vertex", self.vertex)
        })?;
        match count {
            1 | 2 if numbers[0].is_finite() => {
                let more = self.vertex + 1 - self.weights.len();
                room::reserve(&mut self.weights, more)?;
                self.weights.resize(self.vertex, 1.0);
                self.weights.push(numbers[0]);
            }
            3.. if numbers.iter().all(|x| x.is_finite()) => {
                let [r, g, b, a] = numbers;
                let a = if count > 3 { a } else { 1.0 };
                self.has_alpha |= count > 3;
                let more = self.vertex + 1 - self.colors.len();
                room::reserve(&mut self.colors, more)?;
                self.colors.resize(self.vertex, WHITE);
                self.colors.push([r, g, b, a]);
            }
            _ => {}
        }
        self.vertex += 1;
        Ok(())
    }

    fn texture(&mut self, statement: &Statement<'_>) -> Result<(), IoError> {
        let element = || Element::new("texture coordinate", self.textures.count);
        let (numbers, count) = numbers::<3>(&mut statement.arguments(), statement.line, element)?;
        if count == 0 {
            return Err(too_few(statement.line, element(), 0, 1));
        }
        self.texture_components = self.texture_components.max(count);
        room::reserve(&mut self.textures.values, numbers.len())?;
        self.textures.values.extend(numbers);
        self.textures.count += 1;
        Ok(())
    }

    fn normal(&mut self, statement: &Statement<'_>) -> Result<(), IoError> {
        let element = || Element::new("normal", self.normals.count);
        let (numbers, count) = numbers::<3>(&mut statement.arguments(), statement.line, element)?;
        if count < 3 {
            return Err(too_few(statement.line, element(), count, 3));
        }
        room::reserve(&mut self.normals.values, numbers.len())?;
        self.normals.values.extend(numbers);
        self.normals.count += 1;
        Ok(())
    }

    fn face(&mut self, statement: &Statement<'_>) -> Result<(), IoError> {
        let face = self.face;
        let place = Place::Line(statement.line);
        for token in statement.arguments() {
            let corner = corner(token.text).ok_or_else(|| IoError::BadNumber {
                place,
                element: Element::new("face", face),
                text: quote(token.text),
                expected: CORNER,
            })?;
            let references = [
                (
                    &mut self.textures,
                    corner.texture,
                    "texture coordinate",
                    "vt",
                ),
                (&mut self.normals, corner.normal, "normal", "vn"),
            ];
            for (table, index, what, keyword) in references {
                let entry = match index {
                    None => NONE,
                    Some(index) => resolve(index, table.count, table.total).ok_or_else(|| {
                        IoError::Malformed {
                            place,
                            problem: out_of_range(face, index, table, what, keyword),
                        }
                    })?,
                };
                if table.total > 0 {
                    room::push(&mut table.indices, entry)?;
                }
            }
        }
        self.face += 1;
        Ok(())
    }

    fn finish(self) -> Attributes {
        let vertices = self.mesh.positions.len();
        let mut attributes = Attributes {
            labels: self
                .labels
                .into_iter()
                .filter_map(RawLabels::finish)
                .collect(),
            comments: self.comments,
            libraries: self.libraries,
            ..Attributes::default()
        };
        let mut property = |name: &str, components, values| {
            attributes.vertices.push(Property {
                name: name.to_owned(),
                components,
                values: Values::F64(values),
            });
        };
        if !self.colors.is_empty() {
            let mut colors = self.colors;
            colors.resize(vertices, WHITE);
            let components = if self.has_alpha { 4 } else { 3 };
            property(COLOR, components, narrow(&colors, components));
        }
        if !self.weights.is_empty() {
            let mut weights = self.weights;
            weights.resize(vertices, 1.0);
            property(WEIGHT, 1, weights);
        }
        let mut corners = |name: &str, components, values, indices| {
            attributes.corners.push(CornerProperty {
                name: name.to_owned(),
                components,
                values: Values::F64(values),
                indices,
            });
        };
        if self.textures.total > 0 {
            let values = match self.texture_components {
                3 => self.textures.values,
                components => narrow(self.textures.values.as_chunks::<3>().0, components),
            };
            corners(UV, self.texture_components, values, self.textures.indices);
        }
        if self.normals.total > 0 {
            corners(NORMAL, 3, self.normals.values, self.normals.indices);
        }
        attributes
    }
}

const WHITE: [f64; 4] = [1.0; 4];

/// The first components of each row.
fn narrow<const N: usize>(rows: &[[f64; N]], components: usize) -> Vec<f64> {
    rows.iter()
        .flat_map(|row| &row[..components])
        .copied()
        .collect()
}

/// Parses up to `N` numbers, and returns them with their count; further tokens are ignored.
fn numbers<const N: usize>(
    tokens: &mut Tokens<'_>,
    line: usize,
    element: impl Fn() -> Element,
) -> Result<([f64; N], usize), IoError> {
    let mut numbers = [0.0; N];
    let mut count = 0;
    for (number, token) in numbers.iter_mut().zip(tokens) {
        *number = number::parse_f64(token.text).ok_or_else(|| IoError::BadNumber {
            place: Place::Line(line),
            element: element(),
            text: quote(token.text),
            expected: "a number",
        })?;
        count += 1;
    }
    Ok((numbers, count))
}

fn too_few(line: usize, element: Element, found: usize, needed: usize) -> IoError {
    IoError::TooFewNumbers {
        place: Place::Line(line),
        element,
        found,
        needed,
    }
}

fn out_of_range(face: usize, index: i64, table: &Table, what: &str, keyword: &str) -> String {
    match table.total {
        0 => format!("face {face} refers to {what} {index}, but there are none ({keyword})"),
        // A relative index counts back from the latest entry.
        _ if index < 0 => format!(
            "face {face} refers to {what} {index}, but only {} precede it ({keyword})",
            table.count
        ),
        total => format!(
            "face {face} refers to {what} {index}, but they are numbered 1 to {total} ({keyword})"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::Limits;

    fn attributes(text: &[u8]) -> Result<Attributes, IoError> {
        let document = crate::obj::open(text.to_vec(), &Limits::default()).unwrap();
        let attributes = document.attributes().map(|a| a.into_owned());
        if let Ok(attributes) = &attributes {
            let faces = document.faces();
            let vertices = document.positions().len();
            let misfit = attributes.misfit(vertices, faces.len(), faces.num_corners());
            assert_eq!(misfit, None);
        }
        attributes
    }

    fn refusal(lines: &str) -> String {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{lines}\n");
        attributes(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn everything_about_corners_and_faces_is_decoded() {
        let text = b"# by hand\r\nmtllib a b.mtl c.mtl\no K\xf6rper\nv 0 0 0\nv 1 0 0\nv 0 1 0 # last\n\
            f 1 2 3\nvt 0.25\nvt 0.5 1\nvn 0 0 1\ng left  arm\nusemtl red #2\ns 1\nf 1/-2/-1 2/2 3//1\n\
            f -3/ -2// -1\nusemtl (null)\ns off\ng\nf 1/3/2 2/1 3/1\nvt 9 8 7\nvn 1 2 3 4\n";
        let found = attributes(text).unwrap();
        let label = |kind, names: &[&str], faces: &[u32]| Labels {
            kind,
            names: names.iter().map(|&n| n.to_owned()).collect(),
            faces: faces.to_vec(),
        };
        let expected = Attributes {
            vertices: Vec::new(),
            faces: Vec::new(),
            corners: vec![
                CornerProperty {
                    name: UV.to_owned(),
                    components: 3,
                    values: Values::F64(vec![0.25, 0.0, 0.0, 0.5, 1.0, 0.0, 9.0, 8.0, 7.0]),
                    indices: [[NONE; 3], [0, 1, NONE], [NONE; 3], [2, 0, 0]].concat(),
                },
                CornerProperty {
                    name: NORMAL.to_owned(),
                    components: 3,
                    values: Values::F64(vec![0.0, 0.0, 1.0, 1.0, 2.0, 3.0]),
                    indices: [[NONE; 3], [0, NONE, 0], [NONE; 3], [1, NONE, NONE]].concat(),
                },
            ],
            labels: vec![
                label(LabelKind::Object, &["K\u{f6}rper"], &[0, 0, 0, 0]),
                label(LabelKind::Group, &["left  arm"], &[NONE, 0, 0, NONE]),
                label(LabelKind::Material, &["red #2"], &[NONE, 0, 0, NONE]),
                label(LabelKind::Smoothing, &["1"], &[NONE, 0, 0, NONE]),
            ],
            comments: vec!["by hand".to_owned(), "last".to_owned()],
            libraries: vec!["a b.mtl c.mtl".to_owned()],
        };
        assert_eq!(found, expected);
    }

    #[test]
    fn colours_and_weights_stand_behind_the_position() {
        let found = attributes(
            b"v 0 0 0\nv 0 0 0 0.5 0.25 1\nv 0 0 0 nan nan nan\nv 1 1 1 2 # w\nv 0 0 0 inf\n",
        )
        .unwrap();
        let color = found.vertex(COLOR).unwrap();
        assert_eq!(color.components, 3);
        let mut expected = vec![1.0; 15];
        expected[3] = 0.5;
        expected[4] = 0.25;
        assert_eq!(color.values, Values::F64(expected));
        let weights = Values::F64(vec![1.0, 1.0, 1.0, 2.0, 1.0]);
        assert_eq!(found.vertex(WEIGHT).unwrap().values, weights);
        let alpha = attributes(b"v 0 0 0\nv 0 0 0 0 0 0 0.5\n").unwrap();
        let color = alpha.vertex(COLOR).unwrap();
        let expected = vec![1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.5];
        assert_eq!(
            (color.components, &color.values),
            (4, &Values::F64(expected))
        );
        for none in [&b"v 0 0 0\n"[..], b"v 0 0 0 nan nan nan\nv 0 0 0 inf\n"] {
            assert!(attributes(none).unwrap().is_empty());
        }
    }

    #[test]
    fn refusals_name_line_element_and_trouble() {
        assert_eq!(
            refusal("vt 0 0\nf 1/-2 2 3"),
            "line 5: face 0 refers to texture coordinate -2, but only 1 precede it (vt)"
        );
        assert_eq!(
            refusal("vn 0 0 1\nf 1//2 2//1 3//1"),
            "line 5: face 0 refers to normal 2, but they are numbered 1 to 1 (vn)"
        );
        assert_eq!(
            refusal("vn 0 0 1\nf 1//-2 2//1 3//1"),
            "line 5: face 0 refers to normal -2, but only 1 precede it (vn)"
        );
        assert_eq!(
            refusal("f 1//1 2//1 3//1"),
            "line 4: face 0 refers to normal 1, but there are none (vn)"
        );
        assert!(
            refusal("vt 1\nf 1/0 2 3").starts_with("line 5: face 0 refers to texture coordinate 0")
        );
        assert!(
            refusal("f 1//6148914691236517206 2 3")
                .starts_with("line 4: face 0 has `1//6148914691236517206` where a corner")
        );
        assert!(
            refusal("vn 1 2\nvn 1 2 3").starts_with("line 4: normal 0 has 2 numbers; it needs 3")
        );
        assert!(refusal("vt # 1").starts_with("line 4: texture coordinate 0 has 0 numbers"));
        assert!(refusal("vn 0 0 x").starts_with("line 4: normal 0 has `x` where a number"));
        assert!(refusal("v 0 0 0 red").starts_with("line 4: vertex 3 has `red` where a number"));
    }
}
