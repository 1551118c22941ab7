//! A shape of the model: positions that never change, with an identity.

use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use cotan::geometry::Positions;
use nalgebra::Point3;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// One position per vertex of the model. Copies share the positions.
///
/// Each call of [`Shape::new`] gives another identity, and copies keep it: [`Shape::is`] tells in
/// constant time whether two shapes are one. Two shapes are equal (`==`) if their positions are.
///
/// In JSON a shape is the base64 code of its coordinates as little-endian `f64`, bit for bit.
#[derive(Clone)]
pub struct Shape {
    id: u64,
    positions: Arc<Positions<f64>>,
}

impl Shape {
    /// Makes a shape with an identity of its own.
    pub fn new(positions: Positions<f64>) -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self {
            id: NEXT.fetch_add(1, Ordering::Relaxed),
            positions: Arc::new(positions),
        }
    }

    /// Returns `true` if both are the same shape, not merely equal ones.
    pub fn is(&self, other: &Self) -> bool {
        self.id == other.id
    }

    /// The positions.
    pub fn positions(&self) -> &Positions<f64> {
        &self.positions
    }

    /// The coordinates as little-endian `f64`, three per vertex.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let numbers = self.positions.values().flat_map(|p| [p.x, p.y, p.z]);
        numbers.flat_map(f64::to_le_bytes).collect()
    }

    /// Reads what [`Self::to_bytes`] writes; `None` if the length is not that of positions.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (numbers, rest) = bytes.as_chunks::<8>();
        if !rest.is_empty() || numbers.len() % 3 != 0 {
            return None;
        }
        let number = |k: usize| f64::from_le_bytes(numbers[k]);
        let points = (0..numbers.len() / 3)
            .map(|k| Point3::new(number(3 * k), number(3 * k + 1), number(3 * k + 2)));
        Some(Self::new(points.collect()))
    }
}

impl Deref for Shape {
    type Target = Positions<f64>;

    fn deref(&self) -> &Positions<f64> {
        &self.positions
    }
}

impl std::fmt::Debug for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let first = self.positions.values().next();
        write!(f, "Shape {} of {} ({first:?} …)", self.id, self.len())
    }
}

impl PartialEq for Shape {
    fn eq(&self, other: &Self) -> bool {
        self.is(other) || self.positions == other.positions
    }
}

impl Serialize for Shape {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&STANDARD.encode(self.to_bytes()))
    }
}

impl<'de> Deserialize<'de> for Shape {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = String::deserialize(from)?;
        let bytes = STANDARD.decode(text).map_err(D::Error::custom)?;
        Self::from_bytes(&bytes).ok_or_else(|| D::Error::custom("not a whole number of positions"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_keeps_every_bit_and_its_identity() {
        let points = [[0.1, -0.0, 5e-324], [1e300, f64::MIN_POSITIVE, -7.0]];
        let shape = Shape::new(points.iter().map(|&p| Point3::from(p)).collect());
        let text = serde_json::to_string(&shape).unwrap();
        let read: Shape = serde_json::from_str(&text).unwrap();
        assert_eq!(read.to_bytes(), shape.to_bytes());
        assert!(shape == read && !shape.is(&read) && shape.is(&shape.clone()));
        assert!(serde_json::from_str::<Shape>("\"AAAA\"").is_err());
    }
}
