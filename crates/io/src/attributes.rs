//! Data of a mesh file on vertices, corners and faces beyond positions and connectivity.

use crate::remap::Remap;

/// Name of the property that holds normals, in every format.
pub const NORMAL: &str = "normal";
/// Name of the property that holds texture coordinates, in every format.
///
/// The second coordinate points up, as in OBJ and PLY. In glTF it points down, so it is read and
/// written there as 1 − v.
pub const UV: &str = "uv";
/// Name of the property that holds colours, in every format: integers from 0 to the maximum of
/// the type, or real numbers from 0 to 1; three components, or four with alpha.
pub const COLOR: &str = "color";

/// Entry of an index list for a corner or face without a value.
pub const NONE: u32 = u32::MAX;

/// The contents of a document besides positions and faces that more than one format can
/// represent.
///
/// Contents specific to one format (a glTF animation, a free-form curve of an OBJ) are not
/// included; they stay in the file and are written back with it.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Attributes {
    /// Per-vertex values.
    pub vertices: Vec<Property>,
    /// Per-face values.
    pub faces: Vec<Property>,
    /// Values shared by corners through an index, like the `vt` and `vn` of an OBJ.
    pub corners: Vec<CornerProperty>,
    /// Names assigned to faces: groups, objects, materials, smoothing groups.
    pub labels: Vec<Labels>,
    /// Comments, in order.
    pub comments: Vec<String>,
    /// Material libraries (`mtllib` of an OBJ), in order.
    pub libraries: Vec<String>,
}

/// A property of all vertices, or of all faces.
#[derive(Clone, PartialEq, Debug)]
pub struct Property {
    /// [`NORMAL`], [`UV`], [`COLOR`], or the name given in the file.
    pub name: String,
    /// Number of components per element; 1 for a scalar. Unused for [`Values::Lists`].
    pub components: usize,
    /// The values: `components` numbers per element, in element order.
    pub values: Values,
}

/// A table of values, and an index into it for each corner.
#[derive(Clone, PartialEq, Debug)]
pub struct CornerProperty {
    /// [`NORMAL`], [`UV`], [`COLOR`], or the name given in the file.
    pub name: String,
    /// Number of components per value.
    pub components: usize,
    /// The table, with `components` numbers per value.
    pub values: Values,
    /// For each corner, in face order, the index of its value, or [`NONE`].
    pub indices: Vec<u32>,
}

/// Names of one kind, and the faces that they are assigned to.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Labels {
    /// The kind of the names.
    pub kind: LabelKind,
    /// The names, in order of first use. The label of a face in several groups is their names
    /// separated by spaces, as in the file.
    pub names: Vec<String>,
    /// For each face, the index of its name, or [`NONE`].
    pub faces: Vec<u32>,
}

/// The meaning of a label.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[non_exhaustive]
pub enum LabelKind {
    /// `o` in an OBJ, a mesh of a glTF, a solid of an STL.
    Object,
    /// `g` in an OBJ.
    Group,
    /// `usemtl` in an OBJ, a material of a glTF.
    Material,
    /// `s` in an OBJ.
    Smoothing,
}

/// Numbers in the number type of the file.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "each holds numbers of the type that it is named for"
)]
pub enum Values {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
    /// One list of numbers per element, as in PLY.
    Lists {
        /// End offset of each element's list in `items`.
        ends: Vec<usize>,
        /// The concatenated items of all lists; not lists themselves.
        items: Box<Values>,
    },
}

/// Evaluates an expression with the numbers of [`Values`], whatever their type, or another with
/// the end offsets and the items of lists.
macro_rules! with_numbers {
    ($values:expr, $numbers:pat => $result:expr, $lists:pat => $other:expr) => {
        match $values {
            crate::attributes::Values::I8($numbers) => $result,
            crate::attributes::Values::U8($numbers) => $result,
            crate::attributes::Values::I16($numbers) => $result,
            crate::attributes::Values::U16($numbers) => $result,
            crate::attributes::Values::I32($numbers) => $result,
            crate::attributes::Values::U32($numbers) => $result,
            crate::attributes::Values::F32($numbers) => $result,
            crate::attributes::Values::F64($numbers) => $result,
            crate::attributes::Values::Lists { ends: $lists, .. } => $other,
        }
    };
}
pub(crate) use with_numbers;

/// A number type of [`Values`].
trait Number {
    /// The nearest number of the type.
    fn nearest(value: f64) -> Self;
}

macro_rules! number {
    ($($type:ty, $value:ident => $nearest:expr;)*) => {
        $(impl Number for $type {
            fn nearest($value: f64) -> Self {
                $nearest as Self
            }
        })*
    };
}
number! {
    i8, x => x.round();
    u8, x => x.round();
    i16, x => x.round();
    u16, x => x.round();
    i32, x => x.round();
    u32, x => x.round();
    f32, x => x;
    f64, x => x;
}

impl Values {
    /// The count of numbers, or of lists.
    pub fn len(&self) -> usize {
        with_numbers!(self, v => v.len(), ends => ends.len())
    }

    /// Returns `true` if there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The number that means 1 in a colour: the largest of an integer type, otherwise 1.
    pub fn unit(&self) -> f64 {
        match self {
            Self::I8(_) => i8::MAX.into(),
            Self::U8(_) => u8::MAX.into(),
            Self::I16(_) => i16::MAX.into(),
            Self::U16(_) => u16::MAX.into(),
            Self::I32(_) => i32::MAX.into(),
            Self::U32(_) => u32::MAX.into(),
            Self::F32(_) | Self::F64(_) | Self::Lists { .. } => 1.0,
        }
    }

    /// Gathers the values of the given elements, with `components` numbers each.
    ///
    /// Elements past the end are skipped; [`NONE`] yields zeros or an empty list.
    pub(crate) fn gather(&self, components: usize, elements: impl Iterator<Item = usize>) -> Self {
        fn pick<T: Copy + Default>(
            numbers: &[T],
            components: usize,
            elements: impl Iterator<Item = usize>,
        ) -> Vec<T> {
            let mut out = Vec::new();
            for element in elements {
                let start = element.saturating_mul(components);
                match numbers.get(start..start.saturating_add(components)) {
                    Some(found) => out.extend_from_slice(found),
                    None if element == NONE as usize => {
                        out.resize(out.len() + components, T::default());
                    }
                    None => {}
                }
            }
            out
        }
        match self {
            Self::I8(v) => Self::I8(pick(v, components, elements)),
            Self::U8(v) => Self::U8(pick(v, components, elements)),
            Self::I16(v) => Self::I16(pick(v, components, elements)),
            Self::U16(v) => Self::U16(pick(v, components, elements)),
            Self::I32(v) => Self::I32(pick(v, components, elements)),
            Self::U32(v) => Self::U32(pick(v, components, elements)),
            Self::F32(v) => Self::F32(pick(v, components, elements)),
            Self::F64(v) => Self::F64(pick(v, components, elements)),
            Self::Lists { ends, items } => {
                let (mut new_ends, mut taken) = (Vec::new(), Vec::new());
                for element in elements {
                    if let Some(&end) = ends.get(element) {
                        let start = element.checked_sub(1).map_or(0, |before| ends[before]);
                        taken.extend(start..end);
                        new_ends.push(taken.len());
                    } else if element == NONE as usize {
                        new_ends.push(taken.len());
                    }
                }
                Self::Lists {
                    ends: new_ends,
                    items: Box::new(items.gather(1, taken.into_iter())),
                }
            }
        }
    }

    /// Appends values of the same type. Returns `false`, and changes nothing, if the types differ.
    pub(crate) fn append(&mut self, others: &Self) -> bool {
        match (self, others) {
            (Self::I8(v), Self::I8(others)) => v.extend(others),
            (Self::U8(v), Self::U8(others)) => v.extend(others),
            (Self::I16(v), Self::I16(others)) => v.extend(others),
            (Self::U16(v), Self::U16(others)) => v.extend(others),
            (Self::I32(v), Self::I32(others)) => v.extend(others),
            (Self::U32(v), Self::U32(others)) => v.extend(others),
            (Self::F32(v), Self::F32(others)) => v.extend(others),
            (Self::F64(v), Self::F64(others)) => v.extend(others),
            (
                Self::Lists { ends, items },
                Self::Lists {
                    ends: other_ends,
                    items: others,
                },
            ) => {
                let before = items.len();
                if !items.append(others) {
                    return false;
                }
                ends.extend(other_ends.iter().map(|end| end + before));
            }
            _ => return false,
        }
        true
    }

    /// Replaces the number at `index`, rounded to the type. Does nothing past the end.
    pub(crate) fn set(&mut self, index: usize, value: f64) {
        fn put<T: Number>(numbers: &mut [T], index: usize, value: f64) {
            if let Some(number) = numbers.get_mut(index) {
                *number = T::nearest(value);
            }
        }
        with_numbers!(self, v => put(v, index, value), _ => {});
    }

    /// Appends a number, rounded to the type. Lists are left unchanged.
    pub(crate) fn push(&mut self, value: f64) {
        with_numbers!(self, v => v.push(Number::nearest(value)), _ => {});
    }

    /// The exact number at `index`; `None` past the end and for lists.
    pub fn get(&self, index: usize) -> Option<f64> {
        fn at<T: Copy + Into<f64>>(numbers: &[T], index: usize) -> Option<f64> {
            numbers.get(index).map(|&x| x.into())
        }
        with_numbers!(self, v => at(v, index), _ => None)
    }
}

impl Attributes {
    /// Returns `true` if there are no attributes.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// The vertex property with this name.
    pub fn vertex(&self, name: &str) -> Option<&Property> {
        self.vertices.iter().find(|p| p.name == name)
    }

    /// The face property with this name.
    pub fn face(&self, name: &str) -> Option<&Property> {
        self.faces.iter().find(|p| p.name == name)
    }

    /// The corner property with this name.
    pub fn corner(&self, name: &str) -> Option<&CornerProperty> {
        self.corners.iter().find(|p| p.name == name)
    }

    /// The labels of this kind.
    pub fn label(&self, kind: LabelKind) -> Option<&Labels> {
        self.labels.iter().find(|l| l.kind == kind)
    }

    /// Returns the attributes of a mesh made of this one's vertices and faces.
    pub(crate) fn remapped(&self, remap: &Remap) -> Self {
        let gather = |p: &Property, sources: &[u32]| Property {
            values: p
                .values
                .gather(p.components, sources.iter().map(|&i| i as usize)),
            ..p.clone()
        };
        let pick = |numbers: &[u32], sources: &[u32]| -> Vec<u32> {
            let number = |&i: &u32| numbers.get(i as usize).copied().unwrap_or(NONE);
            sources.iter().map(number).collect()
        };
        Self {
            vertices: self
                .vertices
                .iter()
                .map(|p| gather(p, &remap.vertices))
                .collect(),
            faces: self
                .faces
                .iter()
                .map(|p| gather(p, &remap.face_sources))
                .collect(),
            corners: self
                .corners
                .iter()
                .map(|p| CornerProperty {
                    indices: pick(&p.indices, &remap.corner_sources),
                    ..p.clone()
                })
                .collect(),
            labels: self
                .labels
                .iter()
                .map(|l| Labels {
                    faces: pick(&l.faces, &remap.face_sources),
                    ..l.clone()
                })
                .collect(),
            ..self.clone()
        }
    }

    /// Describes the first mismatch with a mesh of these numbers of vertices, faces and corners.
    pub(crate) fn misfit(
        &self,
        num_vertices: usize,
        num_faces: usize,
        num_corners: usize,
    ) -> Option<String> {
        let property = |p: &Property, count: usize, what: &str| {
            let expected = match p.values {
                Values::Lists { .. } => count,
                _ => count.checked_mul(p.components)?,
            };
            let whole = match &p.values {
                Values::Lists { ends, items } => {
                    ends.is_sorted()
                        && ends.last().copied().unwrap_or(0) == items.len()
                        && !matches!(**items, Values::Lists { .. })
                }
                _ => p.components > 0,
            };
            (!whole || p.values.len() != expected).then(|| {
                format!(
                    "the {what} property `{}` does not have {count} values",
                    p.name
                )
            })
        };
        let corner = |p: &CornerProperty| {
            let table = p.values.len().checked_div(p.components).unwrap_or(0);
            let fits = p.indices.len() == num_corners
                && p.components > 0
                && p.values.len().is_multiple_of(p.components)
                && !matches!(p.values, Values::Lists { .. })
                && p.indices.iter().all(|&i| i == NONE || (i as usize) < table);
            (!fits).then(|| format!("the corner property `{}` does not fit the corners", p.name))
        };
        let label = |l: &Labels| {
            let fits = l.faces.len() == num_faces
                && l.faces
                    .iter()
                    .all(|&i| i == NONE || (i as usize) < l.names.len());
            (!fits).then(|| format!("the labels {:?} do not fit the faces", l.kind))
        };
        self.vertices
            .iter()
            .find_map(|p| property(p, num_vertices, "vertex"))
            .or_else(|| {
                self.faces
                    .iter()
                    .find_map(|p| property(p, num_faces, "face"))
            })
            .or_else(|| self.corners.iter().find_map(corner))
            .or_else(|| self.labels.iter().find_map(label))
    }
}
