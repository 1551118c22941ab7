//! The affine transform of a handle: scale, then rotate, then translate; or a matrix.

use std::f64::consts::PI;

use nalgebra::{Matrix4, Point3, Rotation3, Translation3, Unit, Vector3};

/// A transform as given in a handles file.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Transform {
    pub(super) scale: Option<f64>,
    pub(super) rotate: Option<Rotate>,
    pub(super) translate: Option<Vector3<f64>>,
    pub(super) matrix: Option<Vec<Vec<f64>>>,
    /// The rotation vector of the matrix, in radians.
    pub(super) turn: Option<Vector3<f64>>,
}

#[derive(Clone, PartialEq, Debug)]
pub(super) struct Rotate {
    pub(super) axis: Vector3<f64>,
    pub(super) degrees: f64,
    pub(super) about: Option<Point3<f64>>,
}

impl Transform {
    /// Returns the matrix, which acts on columns (x, y, z, 1).
    ///
    /// `centroid` is that of the handle's vertices.
    ///
    /// # Errors
    /// The problem, worded to follow "handle 3 ".
    pub(super) fn matrix(&self, centroid: Point3<f64>) -> Result<Matrix4<f64>, String> {
        let parts = self.scale.is_some() || self.rotate.is_some() || self.translate.is_some();
        match &self.matrix {
            None if self.turn.is_some() => {
                Err("has a \"turn\" but no \"matrix\"; write \"rotate\" instead".into())
            }
            Some(_) if parts => Err(
                "has a \"matrix\" in addition to other parts of a transform; keep one of the two"
                    .into(),
            ),
            Some(rows) => from_rows(rows).map_err(|problem| format!("has a matrix that {problem}")),
            None if !parts => {
                Err("has an empty transform; write \"fixed\": true for vertices that stay".into())
            }
            None => self.compose(centroid),
        }
    }

    /// Returns the rotation vector, in radians, if it is more than half a turn.
    ///
    /// The matrix does not distinguish it from the complementary rotation.
    pub(super) fn wide_turn(&self) -> Option<Vector3<f64>> {
        if let Some(turn) = self.turn {
            return (turn.norm() > PI).then_some(turn);
        }
        let rotate = self.rotate.as_ref()?;
        let axis = Unit::try_new(rotate.axis, 0.0)?;
        let is_wide = rotate.degrees.abs() > 180.0;
        is_wide.then(|| axis.into_inner() * rotate.degrees.to_radians())
    }

    fn compose(&self, centroid: Point3<f64>) -> Result<Matrix4<f64>, String> {
        let mut matrix = Matrix4::identity();
        if let Some(scale) = self.scale {
            if scale == 0.0 {
                return Err(
                    "has the scale 0, which would collapse its vertices to one point".into(),
                );
            }
            matrix = about(centroid, Matrix4::new_scaling(scale)) * matrix;
        }
        if let Some(rotate) = &self.rotate {
            let axis = Unit::try_new(rotate.axis, 0.0)
                .ok_or("rotates about an axis of length 0; give the axis a direction")?;
            let turn = Rotation3::from_axis_angle(&axis, rotate.degrees.to_radians());
            let pivot = rotate.about.unwrap_or(centroid);
            matrix = about(pivot, turn.to_homogeneous()) * matrix;
        }
        if let Some(translate) = self.translate {
            matrix = Translation3::from(translate).to_homogeneous() * matrix;
        }
        Ok(matrix)
    }
}

/// The transform that does at `pivot` what `matrix` does at the origin.
fn about(pivot: Point3<f64>, matrix: Matrix4<f64>) -> Matrix4<f64> {
    let there = Translation3::from(pivot.coords);
    there.to_homogeneous() * matrix * there.inverse().to_homogeneous()
}

/// The image of a point under an affine map.
pub(super) fn apply(matrix: &Matrix4<f64>, point: Point3<f64>) -> Point3<f64> {
    Point3::from((matrix * point.to_homogeneous()).xyz())
}

/// Builds an affine matrix from its 3 or 4 rows of 4 numbers.
///
/// # Errors
/// The problem, worded to follow "the matrix ".
pub(super) fn from_rows(rows: &[Vec<f64>]) -> Result<Matrix4<f64>, String> {
    if !(3..=4).contains(&rows.len()) {
        return Err(format!("has {} rows; it needs 3 or 4", rows.len()));
    }
    let mut matrix = Matrix4::identity();
    for (i, row) in rows.iter().enumerate() {
        if row.len() != 4 {
            return Err(format!(
                "has {} numbers in row {i}; every row needs 4",
                row.len()
            ));
        }
        for (j, &x) in row.iter().enumerate() {
            matrix[(i, j)] = x;
        }
    }
    if matrix.row(3) != Matrix4::<f64>::identity().row(3) {
        return Err(
            "has another last row than 0 0 0 1; it acts on columns (x, y, z, 1), so a \
                    translation stands in the last column"
                .into(),
        );
    }
    Ok(matrix)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Point3<f64>, b: [f64; 3]) -> bool {
        (a - Point3::from(b)).norm() < 1e-12
    }

    #[test]
    fn a_transform_scales_then_rotates_then_translates() {
        let transform = Transform {
            scale: Some(2.0),
            rotate: Some(Rotate {
                axis: Vector3::z() * 3.0,
                degrees: 90.0,
                about: None,
            }),
            translate: Some(Vector3::new(0.0, 0.0, 5.0)),
            ..Transform::default()
        };
        let matrix = transform.matrix(Point3::new(1.0, 0.0, 0.0)).unwrap();
        assert!(close(
            apply(&matrix, Point3::new(1.0, 0.0, 0.0)),
            [1.0, 0.0, 5.0]
        ));
        assert!(close(
            apply(&matrix, Point3::new(2.0, 0.0, 0.0)),
            [1.0, 2.0, 5.0]
        ));
    }

    #[test]
    fn a_rotation_has_a_point_of_its_own() {
        let rotate = Rotate {
            axis: Vector3::z(),
            degrees: 180.0,
            about: Some(Point3::origin()),
        };
        let transform = Transform {
            rotate: Some(rotate),
            ..Transform::default()
        };
        let matrix = transform.matrix(Point3::new(1.0, 0.0, 0.0)).unwrap();
        assert!(close(
            apply(&matrix, Point3::new(1.0, 0.0, 0.0)),
            [-1.0, 0.0, 0.0]
        ));
    }

    #[test]
    fn a_matrix_is_three_or_four_rows_and_stands_alone() {
        let row = |a: [f64; 4]| a.to_vec();
        let rows = vec![
            row([1.0, 0.0, 0.0, 1.0]),
            row([0.0, 1.0, 0.0, 2.0]),
            row([0.0, 0.0, 1.0, 3.0]),
        ];
        assert!(close(
            apply(&from_rows(&rows).unwrap(), Point3::origin()),
            [1.0, 2.0, 3.0]
        ));
        let mut four = rows.clone();
        four.push(row([0.0, 0.0, 0.0, 1.0]));
        assert_eq!(from_rows(&four), from_rows(&rows));
        four[3] = row([1.0, 2.0, 3.0, 1.0]);
        assert!(from_rows(&four).unwrap_err().contains("last column"));
        assert!(from_rows(&rows[..2]).unwrap_err().contains("2 rows"));
        assert!(
            from_rows(&[vec![1.0], vec![], vec![]])
                .unwrap_err()
                .contains("row 0")
        );

        let both = Transform {
            scale: Some(1.0),
            matrix: Some(rows),
            ..Transform::default()
        };
        assert!(
            both.matrix(Point3::origin())
                .unwrap_err()
                .contains("keep one")
        );
        assert!(
            Transform::default()
                .matrix(Point3::origin())
                .unwrap_err()
                .contains("empty")
        );
    }

    #[test]
    fn singular_transforms_are_refused() {
        let flat = Transform {
            scale: Some(0.0),
            ..Transform::default()
        };
        assert!(flat.matrix(Point3::origin()).is_err());
        let rotate = Rotate {
            axis: Vector3::zeros(),
            degrees: 1.0,
            about: None,
        };
        let lost = Transform {
            rotate: Some(rotate),
            ..Transform::default()
        };
        assert!(lost.matrix(Point3::origin()).unwrap_err().contains("axis"));
    }
}
