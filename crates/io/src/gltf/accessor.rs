//! Accessors: numbers in a buffer, with every offset and length checked before a byte is read.
//!
//! Source: glTF 2.0 specification, section 3.6.2, "Accessors".

use std::borrow::Cow;
use std::cmp::Ordering;

use super::Buffers;
use super::model::{Accessor, View};
use crate::error::IoError;

/// The type of a number in a buffer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    pub(super) fn of_code(code: u64) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// Reads the number at the start of `bytes`; zero past the end, which the checked layout
    /// excludes.
    #[inline]
    pub(super) fn read(self, bytes: &[u8]) -> f64 {
        fn head<const N: usize>(bytes: &[u8]) -> [u8; N] {
            bytes.first_chunk().copied().unwrap_or([0; N])
        }
        match self {
            Self::I8 => i8::from_le_bytes(head(bytes)).into(),
            Self::U8 => u8::from_le_bytes(head(bytes)).into(),
            Self::I16 => i16::from_le_bytes(head(bytes)).into(),
            Self::U16 => u16::from_le_bytes(head(bytes)).into(),
            Self::U32 => u32::from_le_bytes(head(bytes)).into(),
            Self::F32 => f32::from_le_bytes(head(bytes)).into(),
        }
    }

    /// Appends a number, rounded to the type.
    pub(super) fn write(self, out: &mut Vec<u8>, value: f64) {
        let whole = value.round();
        match self {
            Self::I8 => out.extend_from_slice(&(whole as i8).to_le_bytes()),
            Self::U8 => out.push(whole as u8),
            Self::I16 => out.extend_from_slice(&(whole as i16).to_le_bytes()),
            Self::U16 => out.extend_from_slice(&(whole as u16).to_le_bytes()),
            Self::U32 => out.extend_from_slice(&(whole as u32).to_le_bytes()),
            Self::F32 => out.extend_from_slice(&(value as f32).to_le_bytes()),
        }
    }

    /// The divisor of a normalized integer; 1 for the types that are not normalized.
    pub(super) fn unit(self) -> f32 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32767.0,
            Self::U16 => 65535.0,
            Self::U32 | Self::F32 => 1.0,
        }
    }
}

/// A range of strided elements in a buffer, known to be within bounds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Span {
    pub(super) buffer: usize,
    /// The offset of the first element in the buffer.
    pub(super) start: usize,
    pub(super) stride: usize,
    /// Size of one element in bytes.
    pub(super) size: usize,
    pub(super) count: usize,
}

impl Span {
    /// The end of the last element; the start if there is none.
    pub(super) fn end(&self) -> usize {
        match self.count {
            0 => self.start,
            count => self.start + (count - 1) * self.stride + self.size,
        }
    }

    /// The bytes from the first element to the end of the last.
    pub(super) fn bytes<'a>(&self, buffers: &'a Buffers) -> &'a [u8] {
        let bytes = buffers.bytes(self.buffer);
        bytes.get(self.start..self.end()).unwrap_or(&[])
    }

    /// The elements, each of `size` bytes.
    pub(super) fn elements<'a>(&self, buffers: &'a Buffers) -> impl Iterator<Item = &'a [u8]> {
        let size = self.size;
        let elements = self.bytes(buffers).chunks(self.stride);
        elements.map(move |element| &element[..size.min(element.len())])
    }
}

/// An accessor with a checked layout.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Layout {
    /// Its index.
    pub(super) accessor: usize,
    pub(super) count: usize,
    pub(super) component: Component,
    pub(super) components: usize,
    pub(super) normalized: bool,
    /// The location of the elements; without one, they are zero.
    pub(super) base: Option<Span>,
    pub(super) sparse: Option<Sparse>,
}

/// Elements that replace others.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Sparse {
    pub(super) indices: Span,
    pub(super) index_type: Component,
    pub(super) values: Span,
}

impl Layout {
    /// Checks the accessor with this index.
    pub(super) fn new(
        number: u64,
        accessors: &[Accessor],
        views: &[View],
        buffers: &Buffers,
    ) -> Result<Self, IoError> {
        let at = |field: &str| format!("accessors[{number}].{field}");
        let found = usize::try_from(number)
            .ok()
            .and_then(|n| Some((n, accessors.get(n)?)));
        let Some((number, accessor)) = found else {
            return Err(no_such(
                "accessor",
                number,
                accessors.len(),
                "a primitive".to_owned(),
            ));
        };
        let component = component(accessor.component, || at("componentType"))?;
        let components = match &*accessor.shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" | "MAT2" => 4,
            "MAT3" => 9,
            "MAT4" => 16,
            _ => {
                return Err(problem(
                    at("type"),
                    format!(
                        "{} is not an accessor type",
                        crate::error::quote(accessor.shape.as_bytes())
                    ),
                ));
            }
        };
        if accessor.shape.starts_with("MAT") && component.size() < 4 {
            return Err(problem(
                at("type"),
                "matrices of small integers cannot be vertex attributes".to_owned(),
            ));
        }
        let size = components * component.size();
        let base = accessor
            .view
            .map(|view| {
                let part = Part {
                    view,
                    offset: accessor.offset,
                    count: accessor.count,
                    size,
                    is_strided: true,
                };
                part.locate(views, buffers, || at("bufferView"))
            })
            .transpose()?;
        let sparse = accessor.sparse.as_ref();
        let sparse = sparse
            .map(|sparse| {
                if sparse.count > accessor.count {
                    return Err(problem(
                        at("sparse.count"),
                        format!("{} of {} elements", sparse.count, accessor.count),
                    ));
                }
                let path = || at("sparse.indices.componentType");
                let index_type = self::component(sparse.indices.component, path)?;
                if !matches!(index_type, Component::U8 | Component::U16 | Component::U32) {
                    return Err(problem(path(), "indices are unsigned integers".to_owned()));
                }
                let part = |view, offset, size| Part {
                    view,
                    offset,
                    count: sparse.count,
                    size,
                    is_strided: false,
                };
                let (indices, values) = (&sparse.indices, &sparse.values);
                Ok(Sparse {
                    index_type,
                    indices: part(indices.view, indices.offset, index_type.size()).locate(
                        views,
                        buffers,
                        || at("sparse.indices.bufferView"),
                    )?,
                    values: part(values.view, values.offset, size).locate(
                        views,
                        buffers,
                        || at("sparse.values.bufferView"),
                    )?,
                })
            })
            .transpose()?;
        let count = usize::try_from(accessor.count)
            .ok()
            .filter(|&count| base.is_some() || count <= buffers.num_bytes())
            .ok_or_else(|| {
                problem(
                    at("count"),
                    format!(
                        "{} elements without bytes for them, in a file of {} bytes",
                        accessor.count,
                        buffers.num_bytes()
                    ),
                )
            })?;
        Ok(Self {
            accessor: number,
            count,
            component,
            components,
            normalized: accessor.normalized
                && !matches!(component, Component::U32 | Component::F32),
            base,
            sparse,
        })
    }

    /// Size of one element in bytes.
    pub(super) fn size(&self) -> usize {
        self.components * self.component.size()
    }

    /// Visits the bytes of each element, in order, with sparse elements substituted.
    pub(super) fn for_each(
        &self,
        buffers: &Buffers,
        mut element: impl FnMut(usize, &[u8]) -> Result<(), IoError>,
    ) -> Result<(), IoError> {
        let zeros = [0u8; 64];
        let zero = &zeros[..self.size()];
        let mut replaced = self.replaced(buffers)?.into_iter().peekable();
        let mut base = self.base.as_ref().map(|span| span.elements(buffers));
        for i in 0..self.count {
            let own = base.as_mut().and_then(Iterator::next).unwrap_or(zero);
            match replaced.next_if(|&(at, _)| at == i) {
                Some((_, bytes)) => element(i, bytes)?,
                None => element(i, own)?,
            }
        }
        Ok(())
    }

    /// The bytes of one element; sparse indices are assumed to ascend.
    pub(super) fn element<'a>(&self, buffers: &'a Buffers, index: usize) -> Cow<'a, [u8]> {
        let at = |span: &Span, n: usize| {
            let bytes = span.bytes(buffers);
            let start = n.saturating_mul(span.stride);
            bytes.get(start..).map(|b| &b[..span.size.min(b.len())])
        };
        if let Some(sparse) = &self.sparse {
            let (mut low, mut high) = (0, sparse.indices.count);
            while low < high {
                let middle = (low + high) / 2;
                let found = at(&sparse.indices, middle).unwrap_or(&[]);
                match (sparse.index_type.read(found) as usize).cmp(&index) {
                    Ordering::Less => low = middle + 1,
                    Ordering::Greater => high = middle,
                    Ordering::Equal => {
                        let value = at(&sparse.values, middle).unwrap_or(&[]);
                        return Cow::Borrowed(value);
                    }
                }
            }
        }
        match self.base.as_ref().and_then(|base| at(base, index)) {
            Some(bytes) => Cow::Borrowed(bytes),
            None => Cow::Owned(vec![0; self.size()]),
        }
    }

    /// The sparse elements with their indices, in ascending order.
    pub(super) fn replaced<'a>(
        &self,
        buffers: &'a Buffers,
    ) -> Result<Vec<(usize, &'a [u8])>, IoError> {
        let Some(sparse) = &self.sparse else {
            return Ok(Vec::new());
        };
        let path = || format!("accessors[{}].sparse.indices", self.accessor);
        let mut replaced: Vec<(usize, &[u8])> = Vec::new();
        let values = sparse.values.elements(buffers);
        for (index, value) in sparse.indices.elements(buffers).zip(values) {
            // At most 32 bits, so the cast preserves the value.
            let index = sparse.index_type.read(index) as usize;
            if index >= self.count {
                return Err(problem(
                    path(),
                    format!("element {index} of {} is replaced", self.count),
                ));
            }
            if replaced.last().is_some_and(|&(last, _)| last >= index) {
                return Err(problem(path(), format!("{index} does not ascend")));
            }
            replaced.push((index, value));
        }
        Ok(replaced)
    }

    /// The actual value of a component: normalized integers as real numbers.
    ///
    /// These are rounded to 32 bits, as in every renderer.
    #[inline]
    pub(super) fn value(&self, bytes: &[u8], k: usize) -> f64 {
        let raw = bytes.get(k * self.component.size()..).unwrap_or(&[]);
        let raw = self.component.read(raw);
        if self.normalized {
            f64::from((raw as f32 / self.component.unit()).max(-1.0))
        } else {
            raw
        }
    }
}

/// A range of a buffer view.
struct Part {
    view: u64,
    offset: u64,
    count: u64,
    size: usize,
    is_strided: bool,
}

impl Part {
    fn locate(
        &self,
        views: &[View],
        buffers: &Buffers,
        path: impl Fn() -> String,
    ) -> Result<Span, IoError> {
        let number = self.view;
        let view = usize::try_from(number).ok().and_then(|n| views.get(n));
        let Some(view) = view else {
            return Err(no_such("bufferView", number, views.len(), path()));
        };
        let Some(buffer) = usize::try_from(view.buffer)
            .ok()
            .filter(|&n| n < buffers.len())
        else {
            let path = format!("bufferViews[{number}].buffer");
            return Err(no_such("buffer", view.buffer, buffers.len(), path));
        };
        if !buffers.is_there(buffer) {
            return Err(problem(
                format!("buffers[{buffer}].uri"),
                "the buffer has neither a URI nor a binary chunk".to_owned(),
            ));
        }
        let there = buffers.bytes(buffer).len() as u64;
        let end = view
            .offset
            .checked_add(view.length)
            .filter(|&end| end <= there);
        if end.is_none() {
            return Err(problem(
                format!("bufferViews[{number}]"),
                format!(
                    "{} bytes at {} exceed the {there} bytes of buffer {buffer}",
                    view.length, view.offset
                ),
            ));
        }
        let size = self.size as u64;
        let stride = view.stride.filter(|_| self.is_strided).unwrap_or(size);
        // The specification allows 4 to 252. More is harmless, but less than an element is not.
        if stride < size || stride > 1 << 16 {
            return Err(problem(
                format!("bufferViews[{number}].byteStride"),
                format!(
                    "{stride} bytes from element to element do not fit elements of {size} bytes"
                ),
            ));
        }
        let needed = match self.count.checked_sub(1) {
            None => Some(0),
            Some(rest) => rest.checked_mul(stride).and_then(|n| n.checked_add(size)),
        };
        let needed = needed.and_then(|n| n.checked_add(self.offset));
        if needed.is_none_or(|needed| needed > view.length) {
            return Err(problem(
                path(),
                format!(
                    "{} elements of {size} bytes at {} exceed the {} bytes of bufferView {number}",
                    self.count, self.offset, view.length
                ),
            ));
        }
        // All of this lies within the buffer, so it fits `usize`.
        Ok(Span {
            buffer,
            start: (view.offset + self.offset) as usize,
            stride: stride as usize,
            size: self.size,
            count: self.count as usize,
        })
    }
}

fn component(code: u64, path: impl Fn() -> String) -> Result<Component, IoError> {
    Component::of_code(code)
        .ok_or_else(|| problem(path(), format!("{code} is not a component type")))
}

pub(super) fn problem(path: String, problem: String) -> IoError {
    IoError::Gltf { path, problem }
}

/// The error for a reference to a missing object.
pub(super) fn no_such(what: &str, number: u64, count: usize, path: String) -> IoError {
    problem(
        path,
        format!("there is no {what} {number}; there are {count}"),
    )
}
