//! Layout of the rows of each element, and the check that the file has enough bytes for them.

use std::ops::{Range, RangeInclusive};

use ply_rs::ply::{Encoding, PropertyType, ScalarType};

use crate::error::IoError;

use super::groups;
use super::header::{Declaration, DeclarationPlace, Header};
use super::{problem, quote};

/// A number type of PLY.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum NumberType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl NumberType {
    fn of(scalar: &ScalarType) -> Self {
        match scalar {
            ScalarType::Char => Self::I8,
            ScalarType::UChar => Self::U8,
            ScalarType::Short => Self::I16,
            ScalarType::UShort => Self::U16,
            ScalarType::Int => Self::I32,
            ScalarType::UInt => Self::U32,
            ScalarType::Float => Self::F32,
            ScalarType::Double => Self::F64,
        }
    }

    #[inline]
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(super) fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// The range of an integer type; all integers for the others.
    pub(super) fn range(self) -> RangeInclusive<i64> {
        match self {
            Self::I8 => i8::MIN.into()..=i8::MAX.into(),
            Self::U8 => 0..=u8::MAX.into(),
            Self::I16 => i16::MIN.into()..=i16::MAX.into(),
            Self::U16 => 0..=u16::MAX.into(),
            Self::I32 => i32::MIN.into()..=i32::MAX.into(),
            Self::U32 => 0..=u32::MAX.into(),
            Self::F32 | Self::F64 => i64::MIN..=i64::MAX,
        }
    }

    /// The description of a number of this type in error messages.
    pub(super) fn expected(self) -> &'static str {
        match self {
            Self::I8 => "a number of type `char`",
            Self::U8 => "a number of type `uchar`",
            Self::I16 => "a number of type `short`",
            Self::U16 => "a number of type `ushort`",
            Self::I32 => "a number of type `int`",
            Self::U32 => "a number of type `uint`",
            Self::F32 => "a number of type `float`",
            Self::F64 => "a number of type `double`",
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::I8 => "char",
            Self::U8 => "uchar",
            Self::I16 => "short",
            Self::U16 => "ushort",
            Self::I32 => "int",
            Self::U32 => "uint",
            Self::F32 => "float",
            Self::F64 => "double",
        }
    }
}

/// One property of a row.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Property {
    /// A coordinate of a vertex, with its axis and type.
    Coordinate(usize, NumberType),
    /// The corners of a face, with the types of the count and of an index, both integers.
    Corners(NumberType, NumberType),
    /// A number that is preserved but not interpreted.
    Scalar(NumberType),
    /// A list that is preserved but not interpreted, with the types of its length (an integer)
    /// and of its items.
    List(NumberType, NumberType),
}

impl Property {
    /// The size in bytes of the property in every binary row; `None` for a list.
    pub(super) fn fixed_size(self) -> Option<usize> {
        match self {
            Self::Coordinate(_, number) | Self::Scalar(number) => Some(number.size()),
            Self::Corners(..) | Self::List(..) => None,
        }
    }

    /// The type of the number, or of the items of a list.
    pub(super) fn number(self) -> NumberType {
        match self {
            Self::Coordinate(_, number)
            | Self::Scalar(number)
            | Self::Corners(_, number)
            | Self::List(_, number) => number,
        }
    }

    /// The minimum size in bytes of the property in a binary row.
    fn least_bytes(self) -> usize {
        match self {
            Self::Coordinate(_, number) | Self::Scalar(number) => number.size(),
            Self::Corners(length, _) | Self::List(length, _) => length.size(),
        }
    }
}

/// The role of an element.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum ElementKind {
    Vertex,
    Face,
    /// Triangle strips, in a file without faces.
    Strips,
    /// Pairs of vertices.
    Edge,
    Other,
}

/// The rows of one element.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) kind: ElementKind,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
    /// The name of each property.
    pub(super) names: Vec<String>,
    /// The location of its declaration in the header.
    pub(super) place: DeclarationPlace,
}

/// The rows of a file.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    pub(super) num_vertices: usize,
    pub(super) num_faces: usize,
    pub(super) comments: Vec<Range<usize>>,
    /// Offsets of the line `end_header` and of the first row.
    pub(super) header_end: [usize; 2],
}

impl Layout {
    /// Checks that the header describes a mesh and promises no more than `num_bytes` can hold.
    pub(super) fn new(header: Header, num_bytes: usize) -> Result<Self, IoError> {
        let line = header.last_line;
        let body = num_bytes.saturating_sub(header.end);
        let has_faces = header.elements.iter().any(|e| e.name == "face");
        let elements = header
            .elements
            .into_iter()
            .map(|declaration| Element::new(declaration, has_faces, line))
            .collect::<Result<Vec<_>, _>>()?;
        for element in &elements {
            element.check(header.encoding, body, line)?;
        }
        let count = |kind| elements.iter().find(|e| e.kind == kind).map(|e| e.count);
        let num_vertices = count(ElementKind::Vertex)
            .ok_or_else(|| problem(line, "the header declares no element `vertex`"))?;
        Ok(Self {
            encoding: header.encoding,
            num_vertices,
            num_faces: count(ElementKind::Face).unwrap_or(0),
            elements,
            comments: header.comments,
            header_end: [header.last_start, header.end],
        })
    }

    /// The index of the element of a kind.
    pub(super) fn find(&self, kind: ElementKind) -> Option<usize> {
        self.elements.iter().position(|e| e.kind == kind)
    }

    fn surface(&self) -> impl Iterator<Item = &Element> {
        let kinds = [ElementKind::Vertex, ElementKind::Face];
        self.elements
            .iter()
            .filter(move |e| kinds.contains(&e.kind))
    }

    /// Returns `true` if vertices or faces have normals that can be rotated.
    pub(super) fn has_normals(&self) -> bool {
        self.surface().any(|e| groups::normal(e).is_some())
    }

    /// Returns `true` if vertices or faces have something like normals that cannot be rotated.
    pub(super) fn has_odd_normals(&self) -> bool {
        self.surface()
            .any(|e| groups::normal(e).is_none() && e.names.iter().any(|name| name == "nx"))
    }

    /// Lists the contents of the file that attributes cannot represent.
    pub(super) fn extras(&self) -> Vec<String> {
        let mut extras = Vec::new();
        for element in &self.elements {
            let name = &element.name;
            match element.kind {
                ElementKind::Edge | ElementKind::Other => {
                    extras.push(format!("the element {name}"));
                }
                ElementKind::Strips if element.names.len() > 1 => {
                    extras.push(format!("further properties of the element {name}"));
                }
                _ => {}
            }
        }
        extras
    }
}

impl Element {
    fn new(declaration: Declaration, has_faces: bool, line: usize) -> Result<Self, IoError> {
        let kind = match declaration.name.as_str() {
            "vertex" => ElementKind::Vertex,
            "face" => ElementKind::Face,
            "tristrips" if !has_faces => ElementKind::Strips,
            "edge" => ElementKind::Edge,
            _ => ElementKind::Other,
        };
        let mut properties = Vec::new();
        let mut names = Vec::new();
        for (name, data_type) in declaration.properties {
            let property = role(kind, &name, &data_type).ok_or_else(|| {
                let text = format!(
                    "the length of list `{}` is not of an integer type",
                    quote(name.as_bytes())
                );
                problem(line, text)
            })?;
            properties.push(property);
            names.push(name);
        }
        Ok(Self {
            name: declaration.name,
            kind,
            count: declaration.count,
            properties,
            names,
            place: declaration.place,
        })
    }

    /// The size of each row of a binary file in bytes, if it is the same for all rows.
    pub(super) fn stride(&self) -> Option<usize> {
        self.properties.iter().map(|p| p.fixed_size()).sum()
    }

    fn check(&self, encoding: Encoding, body: usize, line: usize) -> Result<(), IoError> {
        let Self {
            name,
            count,
            properties,
            ..
        } = self;
        let has = |wanted: fn(&Property) -> bool| properties.iter().filter(|p| wanted(p)).count();
        if self.kind == ElementKind::Vertex && has(|p| matches!(p, Property::Coordinate(..))) != 3 {
            return Err(problem(
                line,
                "the element `vertex` needs the properties x, y and z",
            ));
        }
        let needs_corners = matches!(self.kind, ElementKind::Face | ElementKind::Strips);
        if needs_corners && has(|p| matches!(p, Property::Corners(..))) != 1 {
            let text = format!(
                "the element `{name}` needs one list of integers, `vertex_indices` or \
                 `vertex_index`"
            );
            return Err(problem(line, text));
        }
        let least: usize = match encoding {
            // At least a digit and a space or line ending each.
            Encoding::Ascii => 2 * properties.len(),
            _ => properties.iter().map(|p| p.least_bytes()).sum(),
        };
        // The last row of a text may lack its line ending.
        let rows = (body + 1).checked_div(least);
        let name = quote(name.as_bytes());
        match rows {
            _ if *count == 0 => Ok(()),
            None => Err(problem(
                line,
                format!("{count} of element `{name}` have no properties"),
            )),
            Some(rows) if *count > rows => {
                let text = format!(
                    "{count} of element `{name}` are promised, but {body} bytes follow the header, \
                     enough for {rows} at most; the file was cut short or its header is wrong"
                );
                Err(problem(line, text))
            }
            Some(_) => Ok(()),
        }
    }
}

/// The role of a property; `None` if the length of a list is not an integer.
fn role(kind: ElementKind, name: &str, data_type: &PropertyType) -> Option<Property> {
    let axis = ["x", "y", "z"].iter().position(|&axis| axis == name);
    Some(match (data_type, axis) {
        (PropertyType::Scalar(scalar), Some(axis)) if kind == ElementKind::Vertex => {
            Property::Coordinate(axis, NumberType::of(scalar))
        }
        (PropertyType::Scalar(scalar), _) => Property::Scalar(NumberType::of(scalar)),
        (PropertyType::List(length, item), _) => {
            let (length, item) = (NumberType::of(length), NumberType::of(item));
            if !length.is_integer() {
                return None;
            }
            let has_corners = matches!(kind, ElementKind::Face | ElementKind::Strips);
            if has_corners && CORNERS.contains(&name) && item.is_integer() {
                Property::Corners(length, item)
            } else {
                Property::List(length, item)
            }
        }
    })
}

/// The names of the list of corners of a face.
pub(super) const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];
