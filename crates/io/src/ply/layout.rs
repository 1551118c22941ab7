//! What the rows of each element hold, and whether the file has bytes for them.

use ply_rs::ply::{ElementDef, Encoding, PropertyType, ScalarType};

use crate::error::IoError;

use super::header::Header;
use super::problem;

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
    /// A coordinate of a vertex: its axis and type.
    Coordinate(usize, NumberType),
    /// The corners of a face: the types of their number and of an index, both integers.
    Corners(NumberType, NumberType),
    /// A number that is kept and not read.
    Scalar(NumberType),
    /// A list that is kept and not read: the types of its length (an integer) and of its items.
    List(NumberType, NumberType),
}

impl Property {
    /// The fewest bytes that the property takes in a binary row.
    fn least_bytes(self) -> usize {
        match self {
            Self::Coordinate(_, number) | Self::Scalar(number) => number.size(),
            Self::Corners(length, _) | Self::List(length, _) => length.size(),
        }
    }
}

/// What an element is to us.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum ElementKind {
    Vertex,
    Face,
    Other,
}

/// The rows of one element.
pub(super) struct Element {
    pub(super) name: String,
    pub(super) kind: ElementKind,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
    /// Names of the properties that are kept and not read.
    unread: Vec<String>,
}

/// The rows of a file.
pub(super) struct Layout {
    pub(super) elements: Vec<Element>,
    pub(super) num_vertices: usize,
    pub(super) num_faces: usize,
}

impl Layout {
    /// Checks that the header describes a mesh and promises no more than `num_bytes` can hold.
    pub(super) fn new(header: &Header, num_bytes: usize) -> Result<Self, IoError> {
        let line = header.last_line;
        let body = num_bytes.saturating_sub(header.end);
        let elements = header
            .ply
            .elements
            .values()
            .map(|def| Element::new(def, line))
            .collect::<Result<Vec<_>, _>>()?;
        for element in &elements {
            element.check(header.ply.encoding, body, line)?;
        }
        let count = |kind| elements.iter().find(|e| e.kind == kind).map(|e| e.count);
        let num_vertices = count(ElementKind::Vertex)
            .ok_or_else(|| problem(line, "the header declares no element `vertex`"))?;
        let num_faces = match count(ElementKind::Face) {
            Some(count) => count,
            None if elements.iter().any(|e| e.name == "tristrips") => {
                let text = "triangle strips are not read; save the mesh with an element `face`";
                return Err(problem(line, text));
            }
            None => 0,
        };
        Ok(Self {
            elements,
            num_vertices,
            num_faces,
        })
    }

    pub(super) fn has_normals(&self) -> bool {
        self.elements
            .iter()
            .any(|element| element.unread.iter().any(|property| property == "nx"))
    }

    /// What the file has besides positions and faces.
    pub(super) fn extras(&self, header: &Header) -> Vec<String> {
        let mut extras = Vec::new();
        for element in &self.elements {
            let name = &element.name;
            if element.kind == ElementKind::Other {
                extras.push(format!("the element {name}"));
            } else if !element.unread.is_empty() {
                let properties = element.unread.join(", ");
                extras.push(format!("the {name} properties {properties}"));
            }
        }
        if header.num_comments > 0 {
            extras.push(format!("{} comments", header.num_comments));
        }
        extras
    }
}

impl Element {
    fn new(def: &ElementDef, line: usize) -> Result<Self, IoError> {
        let kind = match def.name.as_str() {
            "vertex" => ElementKind::Vertex,
            "face" => ElementKind::Face,
            _ => ElementKind::Other,
        };
        let mut properties = Vec::with_capacity(def.properties.len());
        let mut unread = Vec::new();
        for (name, property) in &def.properties {
            let property = role(kind, name, &property.data_type).ok_or_else(|| {
                let text = format!("the length of list `{name}` is not of an integer type");
                problem(line, text)
            })?;
            if matches!(property, Property::Scalar(_) | Property::List(..)) {
                unread.push(name.clone());
            }
            properties.push(property);
        }
        Ok(Self {
            name: def.name.clone(),
            kind,
            count: def.count,
            properties,
            unread,
        })
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
        if self.kind == ElementKind::Face && has(|p| matches!(p, Property::Corners(..))) != 1 {
            let text = "the element `face` needs one list of integers, `vertex_indices` or \
                        `vertex_index`";
            return Err(problem(line, text));
        }
        let least: usize = match encoding {
            // A digit and a blank or line end each.
            Encoding::Ascii => 2 * properties.len(),
            _ => properties.iter().map(|p| p.least_bytes()).sum(),
        };
        // The last row of a text may lack its line end.
        let rows = (body + 1).checked_div(least);
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

/// What a property is to us; `None` if the length of a list is not an integer.
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
            let is_corners = matches!(name, "vertex_indices" | "vertex_index");
            if kind == ElementKind::Face && is_corners && item.is_integer() {
                Property::Corners(length, item)
            } else {
                Property::List(length, item)
            }
        }
    })
}
