//! A PLY file with the coordinates of some vertices replaced where they stand.

use nalgebra::Point3;
use ply_rs::ply::Encoding;

use crate::error::IoError;
use crate::number;
use crate::source::TextPatch;

use super::layout::{NumberType, Property};
use super::{ascii, binary};

/// How the rows of the vertices are laid out.
#[derive(Clone, Debug)]
pub(super) struct VertexRows {
    pub(super) encoding: Encoding,
    pub(super) properties: Vec<Property>,
}

impl VertexRows {
    /// The file with new positions: of each moved vertex its number, where its row starts, and
    /// its position, in ascending order.
    pub(super) fn rewrite(
        &self,
        bytes: &[u8],
        moved: impl Iterator<Item = (usize, usize, Point3<f64>)>,
    ) -> Result<Vec<u8>, IoError> {
        let types = self.coordinate_types();
        match self.encoding {
            Encoding::Ascii => self.rewrite_text(bytes, types, moved),
            Encoding::BinaryLittleEndian => {
                self.rewrite_binary::<binary::Little>(bytes, types, moved)
            }
            Encoding::BinaryBigEndian => self.rewrite_binary::<binary::Big>(bytes, types, moved),
        }
    }

    fn coordinate_types(&self) -> [NumberType; 3] {
        let mut types = [NumberType::F32; 3];
        for property in &self.properties {
            if let Property::Coordinate(axis, number) = *property {
                types[axis] = number;
            }
        }
        types
    }

    fn rewrite_text(
        &self,
        bytes: &[u8],
        types: [NumberType; 3],
        moved: impl Iterator<Item = (usize, usize, Point3<f64>)>,
    ) -> Result<Vec<u8>, IoError> {
        let mut patch = TextPatch::new(bytes);
        for (vertex, start, position) in moved {
            // The row was read with the same walk, so its places are found again.
            let Some(places) = ascii::locate(bytes, start, &self.properties) else {
                continue;
            };
            // The file's order of the properties need not be x, y, z.
            let mut axes = [0, 1, 2];
            axes.sort_by_key(|&axis| places[axis].start);
            for axis in axes {
                let value = Number::new(position[axis], types[axis], vertex)?;
                let place = &places[axis];
                patch.replace(place.start, place.len(), |out| value.push_text(out));
            }
        }
        Ok(patch.finish())
    }

    fn rewrite_binary<B: binary::ByteOrder>(
        &self,
        bytes: &[u8],
        types: [NumberType; 3],
        moved: impl Iterator<Item = (usize, usize, Point3<f64>)>,
    ) -> Result<Vec<u8>, IoError> {
        let mut out = bytes.to_vec();
        for (vertex, start, position) in moved {
            // The row was read with the same walk, so its places are found again.
            let Some(places) = binary::locate::<B>(bytes, start, &self.properties) else {
                continue;
            };
            for axis in 0..3 {
                let value = Number::new(position[axis], types[axis], vertex)?;
                value.store::<B>(&mut out[places[axis]..]);
            }
        }
        Ok(out)
    }
}

/// A coordinate in the file's own type.
enum Number {
    Single(f32),
    Double(f64),
    Integer(i64, usize),
}

impl Number {
    /// Rounds to the nearest number of a floating-point type; integer types take only what they
    /// hold exactly, since rounding would move the vertex by up to half a unit.
    fn new(value: f64, number_type: NumberType, vertex: usize) -> Result<Self, IoError> {
        let does_not_fit = || IoError::DoesNotFit {
            vertex,
            value,
            number_type: number_type.name(),
        };
        match number_type {
            NumberType::F64 => Ok(Self::Double(value)),
            NumberType::F32 => {
                let single = value as f32;
                if single.is_finite() {
                    Ok(Self::Single(single))
                } else {
                    Err(does_not_fit())
                }
            }
            integer => {
                let (least, most) = match integer {
                    NumberType::I8 => (i8::MIN.into(), i8::MAX.into()),
                    NumberType::U8 => (0, u8::MAX.into()),
                    NumberType::I16 => (i16::MIN.into(), i16::MAX.into()),
                    NumberType::U16 => (0, u16::MAX.into()),
                    NumberType::I32 => (i32::MIN.into(), i32::MAX.into()),
                    _ => (0, i64::from(u32::MAX)),
                };
                // A cast saturates, so what is out of range differs after the way back.
                let whole = value as i64;
                if whole as f64 == value && (least..=most).contains(&whole) {
                    Ok(Self::Integer(whole, integer.size()))
                } else {
                    Err(does_not_fit())
                }
            }
        }
    }

    fn push_text(&self, out: &mut String) {
        match *self {
            Self::Single(x) => number::push_f32(out, x),
            Self::Double(x) => number::push_f64(out, x),
            Self::Integer(x, _) => out.push_str(&x.to_string()),
        }
    }

    /// Overwrites the number at the start of `out`.
    fn store<B: binary::ByteOrder>(&self, out: &mut [u8]) {
        match *self {
            Self::Single(x) => out[..4].copy_from_slice(&B::little(x.to_le_bytes())),
            Self::Double(x) => out[..8].copy_from_slice(&B::little(x.to_le_bytes())),
            // The low bytes of a two's complement number are the number in fewer bits.
            Self::Integer(x, 1) => out[..1].copy_from_slice(&(x as u8).to_le_bytes()),
            Self::Integer(x, 2) => out[..2].copy_from_slice(&B::little((x as u16).to_le_bytes())),
            Self::Integer(x, _) => out[..4].copy_from_slice(&B::little((x as u32).to_le_bytes())),
        }
    }
}
