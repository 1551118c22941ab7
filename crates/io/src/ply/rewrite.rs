//! Replacement of moved coordinates and rotated normals in place.

use std::ops::Range;

use nalgebra::Point3;

use crate::error::IoError;
use crate::source::Moves;

use super::PlyFile;
use super::groups;
use super::layout::{Element, ElementKind, NumberType, Property};
use super::rows::{Encoded, Number, Walk, with_encoding};

/// Returns the file with the changes applied.
pub(super) fn rewrite(file: &PlyFile, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
    with_encoding!(file.layout.encoding, patch(file, moves))
}

/// Rounds a position to the number types of the file.
pub(super) fn stored(file: &PlyFile, mut position: Point3<f64>) -> Point3<f64> {
    let elements = file.layout.elements.iter();
    for element in elements.filter(|element| element.kind == ElementKind::Vertex) {
        for axis in axes(element) {
            let is_position = matches!(axis.quantity, Quantity::Position);
            if is_position && element.properties[axis.property].number() == NumberType::F32 {
                position[axis.axis] = f64::from(position[axis.axis] as f32);
            }
        }
    }
    position
}

fn patch<E: Encoded>(file: &PlyFile, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
    let mut patched = Patched::new::<E>(&file.bytes);
    // In file order, since the file is patched from front to back.
    for (number, element) in file.layout.elements.iter().enumerate() {
        match element.kind {
            ElementKind::Vertex => vertices::<E>(file, element, moves, &mut patched)?,
            ElementKind::Face => faces::<E>(file, number, moves, &mut patched),
            _ => {}
        }
    }
    Ok(patched.finish())
}

/// A copy of the bytes with some numbers replaced, built from front to back.
struct Patched<'a> {
    bytes: &'a [u8],
    copied: usize,
    out: Vec<u8>,
}

impl<'a> Patched<'a> {
    fn new<E: Encoded>(bytes: &'a [u8]) -> Self {
        // New numbers in a text are often longer than old ones.
        let room = if E::IS_TEXT { bytes.len() / 8 } else { 0 };
        Self {
            bytes,
            copied: 0,
            out: Vec::with_capacity(bytes.len() + room),
        }
    }

    fn replace<E: Encoded>(&mut self, span: &Range<usize>, number: NumberType, value: Number) {
        let kept = &self.bytes[self.copied..span.start];
        self.out.extend_from_slice(kept);
        E::push(&mut self.out, number, value);
        self.copied = span.end;
    }

    fn finish(mut self) -> Vec<u8> {
        self.out.extend_from_slice(&self.bytes[self.copied..]);
        self.out
    }
}

fn vertices<E: Encoded>(
    file: &PlyFile,
    element: &Element,
    moves: &Moves<'_>,
    patched: &mut Patched<'_>,
) -> Result<(), IoError> {
    let axes = axes(element);
    let mut normals = moves.normals.vertices.iter().peekable();
    let mut moved = moves.vertices().peekable();
    let mut walk = Walk::new(&file.bytes, 0, element);
    loop {
        let next = [
            moved.peek().map(|&(v, _)| v),
            normals.peek().map(|&&(v, _)| v as usize),
        ];
        let Some(vertex) = next.into_iter().flatten().min() else {
            return Ok(());
        };
        let position = moved.next_if(|&(v, _)| v == vertex).map(|(_, p)| p);
        let normal = normals.next_if(|&&(v, _)| v as usize == vertex);
        // The row was read with the same walk, so its cells are found again.
        let Some(start) = file.starts.get(vertex) else {
            continue;
        };
        walk.at = start;
        if walk.next::<E>().is_none() {
            continue;
        }
        let values = |axis: Axis| -> Option<Result<Number, IoError>> {
            let number = element.properties[axis.property].number();
            match axis.quantity {
                Quantity::Position => {
                    let p: Point3<f64> = position?;
                    Some(coordinate(p[axis.axis], number, vertex))
                }
                Quantity::Normal => Some(Ok(rounded(normal?.1[axis.axis], number))),
            }
        };
        for &axis in &axes {
            if let Some(value) = values(axis) {
                let number = element.properties[axis.property].number();
                patched.replace::<E>(&walk.cells[axis.property].span, number, value?);
            }
        }
    }
}

fn faces<E: Encoded>(file: &PlyFile, number: usize, moves: &Moves<'_>, patched: &mut Patched<'_>) {
    let element = &file.layout.elements[number];
    let axes = axes(element);
    let mut normals = moves.normals.faces.iter().peekable();
    let mut walk = Walk::new(&file.bytes, file.elements[number], element);
    for face in 0..element.count {
        if normals.peek().is_none() || walk.next::<E>().is_none() {
            return;
        }
        let Some((_, normal)) = normals.next_if(|&&(f, _)| f as usize == face) else {
            continue;
        };
        for axis in axes.iter().filter(|a| a.quantity == Quantity::Normal) {
            let number = element.properties[axis.property].number();
            let value = rounded(normal[axis.axis], number);
            patched.replace::<E>(&walk.cells[axis.property].span, number, value);
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Position,
    Normal,
}

/// A row property that is one component of a position or normal.
#[derive(Clone, Copy)]
struct Axis {
    quantity: Quantity,
    axis: usize,
    property: usize,
}

/// The components of positions and normals, in row order.
fn axes(element: &Element) -> Vec<Axis> {
    let mut axes = Vec::new();
    for (property, kind) in element.properties.iter().enumerate() {
        if let Property::Coordinate(axis, _) = *kind {
            axes.push(Axis {
                quantity: Quantity::Position,
                axis,
                property,
            });
        }
    }
    if let Some(group) = groups::normal(element) {
        axes.extend(
            group
                .members
                .iter()
                .enumerate()
                .map(|(axis, &property)| Axis {
                    quantity: Quantity::Normal,
                    axis,
                    property,
                }),
        );
    }
    axes.sort_by_key(|axis| axis.property);
    axes
}

/// Converts a coordinate to the file's own type. Floating-point types round to nearest. Integer
/// types accept only exact values, since rounding would move the vertex by up to half a unit.
fn coordinate(value: f64, number: NumberType, vertex: usize) -> Result<Number, IoError> {
    let fitting = match number {
        NumberType::F64 => Some(Number::Double(value)),
        NumberType::F32 => Some(value as f32)
            .filter(|single| single.is_finite())
            .map(Number::Single),
        // A cast saturates, so an out-of-range value differs after the conversion back.
        _ => Some(value as i64)
            .filter(|&whole| whole as f64 == value && number.range().contains(&whole))
            .map(Number::Integer),
    };
    fitting.ok_or(IoError::DoesNotFit {
        vertex,
        value,
        number_type: number.name(),
    })
}

/// The nearest number of a type.
fn rounded(value: f64, number: NumberType) -> Number {
    match number {
        NumberType::F64 => Number::Double(value),
        NumberType::F32 => Number::Single((value as f32).clamp(f32::MIN, f32::MAX)),
        _ => {
            let (least, most) = number.range().into_inner();
            Number::Integer((value.round() as i64).clamp(least, most))
        }
    }
}
