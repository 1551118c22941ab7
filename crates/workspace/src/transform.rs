//! Transforms of handles in numbers, and how they are typed.

use nalgebra::{Matrix3, Matrix4, Point3, Rotation3, Translation3, Vector3};
use serde::{Deserialize, Serialize};

use crate::plain;

/// A transform of handles about a pivot.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Transform {
    /// A translation.
    Move(#[serde(with = "plain::vector")] Vector3<f64>),
    /// A rotation: the unit axis times the angle in degrees, which may exceed half a turn.
    Turn(#[serde(with = "plain::vector")] Vector3<f64>),
    /// A scaling by factors along axes.
    Scale {
        /// The unit axes, which are perpendicular to each other.
        #[serde(with = "plain::axes")]
        axes: Matrix3<f64>,
        /// The factors.
        #[serde(with = "plain::vector")]
        factors: Vector3<f64>,
    },
}

impl Transform {
    /// The affine map.
    pub fn matrix(&self, pivot: &Point3<f64>) -> Matrix4<f64> {
        let linear = match *self {
            Self::Move(by) => return Translation3::from(by).to_homogeneous(),
            Self::Turn(degrees) => *Rotation3::new(degrees.map(f64::to_radians)).matrix(),
            Self::Scale { axes, factors } => {
                axes * Matrix3::from_diagonal(&factors) * axes.transpose()
            }
        };
        let there = Translation3::from(pivot.coords).to_homogeneous();
        let back = Translation3::from(-pivot.coords).to_homogeneous();
        there * linear.to_homogeneous() * back
    }

    /// The rotation vector in radians, which may exceed half a turn.
    pub fn turn(&self) -> Vector3<f64> {
        match self {
            Self::Turn(degrees) => degrees.map(f64::to_radians),
            _ => Vector3::zeros(),
        }
    }
}

/// The kind of a transform.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// A translation, in the units of the model.
    Move,
    /// A rotation, in degrees.
    Turn,
    /// A scaling, by a factor.
    Scale,
}

impl Kind {
    /// The value that changes nothing.
    pub fn neutral(self) -> f64 {
        match self {
            Self::Move | Self::Turn => 0.0,
            Self::Scale => 1.0,
        }
    }
}

/// An input while a transform is typed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Typing {
    /// A digit from 0 to 9.
    Digit(u8),
    /// The decimal point.
    Point,
    /// Changes the sign.
    Minus,
    /// Removes the last digit.
    Back,
    /// Restricts the transform to an axis, 0 to 2. The same axis again lifts that.
    Axis(usize),
}

/// A transform that is being typed, such as "move, X, 0.5".
///
/// Until a digit is typed, its value is that of the pointer.
#[derive(Clone, PartialEq, Debug)]
pub struct Typed {
    /// The kind.
    pub kind: Kind,
    axis: Option<usize>,
    is_negative: bool,
    digits: String,
}

impl Typed {
    /// A transform without an axis and a number.
    pub fn new(kind: Kind) -> Self {
        Self {
            kind,
            axis: None,
            is_negative: false,
            digits: String::new(),
        }
    }

    /// Takes an input.
    pub fn input(&mut self, typing: Typing) {
        match typing {
            Typing::Digit(digit) if self.digits.len() < MOST_DIGITS => {
                self.digits.push(char::from(b'0' + digit.min(9)));
            }
            Typing::Point if !self.digits.contains('.') => self.digits.push('.'),
            Typing::Digit(_) | Typing::Point => {}
            Typing::Minus => self.is_negative = !self.is_negative,
            Typing::Back => drop(self.digits.pop()),
            Typing::Axis(axis) => {
                self.axis = Some(axis.min(2)).filter(|axis| self.axis != Some(*axis));
            }
        }
    }

    /// The axis to which the transform is restricted.
    pub fn axis(&self) -> Option<usize> {
        self.axis
    }

    /// The typed number; `None` if there is none yet.
    pub fn number(&self) -> Option<f64> {
        let size: f64 = match self.digits.as_str() {
            "" | "." => return None,
            digits => digits.parse().ok()?,
        };
        Some(if self.is_negative { -size } else { size })
    }

    /// The transform by the typed number along unit axes, the columns of `axes`.
    ///
    /// Without an axis a movement is along the first one, a rotation about the last one, which
    /// points to the viewer where the axes are those of the view, and a scaling the same in all
    /// directions.
    pub fn transform(&self, axes: &Matrix3<f64>) -> Option<Transform> {
        let number = self.number()?;
        let along = |axis: usize| axes.column(axis).into_owned();
        Some(match self.kind {
            Kind::Move => Transform::Move(along(self.axis.unwrap_or(0)) * number),
            Kind::Turn => Transform::Turn(along(self.axis.unwrap_or(2)) * number),
            Kind::Scale => {
                let mut factors = Vector3::repeat(if self.axis.is_some() { 1.0 } else { number });
                if let Some(axis) = self.axis {
                    factors[axis] = number;
                }
                Transform::Scale {
                    axes: *axes,
                    factors,
                }
            }
        })
    }
}

impl std::fmt::Display for Typed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kind = match self.kind {
            Kind::Move => "Move",
            Kind::Turn => "Turn",
            Kind::Scale => "Scale",
        };
        let axis = self.axis.map_or("", |axis| [" X", " Y", " Z"][axis]);
        let sign = if self.is_negative { "−" } else { "" };
        let unit = if self.kind == Kind::Turn { "°" } else { "" };
        write!(f, "{kind}{axis} {sign}{}{unit}", self.digits)
    }
}

/// No `f64` has more digits than these.
const MOST_DIGITS: usize = 17;

#[cfg(test)]
mod tests {
    use super::*;

    fn typed(kind: Kind, keys: &str) -> Typed {
        let mut typed = Typed::new(kind);
        for key in keys.bytes() {
            typed.input(match key {
                b'x'..=b'z' => Typing::Axis(usize::from(key - b'x')),
                b'.' => Typing::Point,
                b'-' => Typing::Minus,
                b'<' => Typing::Back,
                digit => Typing::Digit(digit - b'0'),
            });
        }
        typed
    }

    #[test]
    fn numbers_and_axes_are_typed_in_any_order() {
        let axes = Matrix3::identity();
        let by = |keys: &str| typed(Kind::Move, keys).transform(&axes);
        assert_eq!(by("x0.5"), Some(Transform::Move(Vector3::x() * 0.5)));
        assert_eq!(by("12<.25-y"), Some(Transform::Move(Vector3::y() * -1.25)));
        assert_eq!(by("2zz"), Some(Transform::Move(Vector3::x() * 2.0)));
        for keys in ["", "x", ".", "-", "3<"] {
            assert_eq!(by(keys), None, "{keys}");
        }
        assert_eq!(by("0..5"), Some(Transform::Move(Vector3::x() * 0.5)));
        assert!(by(&"9".repeat(400)).is_some());
        assert_eq!(typed(Kind::Turn, "z4-00").to_string(), "Turn Z −400°");
    }

    #[test]
    fn maps_turn_about_the_pivot_and_scale_along_axes() {
        let pivot = Point3::new(1.0, 2.0, 3.0);
        let quarter = typed(Kind::Turn, "z450").transform(&Matrix3::identity());
        let quarter = quarter.unwrap();
        let moved = quarter
            .matrix(&pivot)
            .transform_point(&Point3::new(2.0, 2.0, 3.0));
        assert!((moved - Point3::new(1.0, 3.0, 3.0)).norm() < 1e-12);
        assert!((quarter.turn() - Vector3::z() * 450_f64.to_radians()).norm() < 1e-12);
        // Axes turned by 45° about z: a point on the first one moves along it.
        let axes = *Rotation3::new(Vector3::z() * 45_f64.to_radians()).matrix();
        let wide = typed(Kind::Scale, "x3").transform(&axes).unwrap();
        let on = pivot + Vector3::new(1.0, 1.0, 0.0);
        let moved = wide.matrix(&pivot).transform_point(&on);
        assert!((moved - (pivot + Vector3::new(3.0, 3.0, 0.0))).norm() < 1e-12);
        let twice = typed(Kind::Scale, "2").transform(&axes).unwrap();
        let moved = twice.matrix(&pivot).transform_point(&Point3::origin());
        assert!((moved + pivot.coords).coords.norm() < 1e-12);
    }
}
