//! Forms in which ids, points and settings are stored, for `#[serde(with = "…")]`.

/// Vertices as their indices.
pub(crate) mod ids {
    use cotan::halfedge::VertexId;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(crate) fn serialize<S: Serializer>(ids: &[VertexId], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(ids.iter().map(|v| v.index()))
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Vec<VertexId>, D::Error> {
        let indices = Vec::<u32>::deserialize(from)?;
        // Ids have 32 bits; no mesh comes near the half of them.
        match indices.iter().find(|&&index| index > i32::MAX as u32) {
            Some(index) => Err(D::Error::custom(format!("there is no vertex {index}"))),
            None => Ok(indices.iter().map(|&i| VertexId::new(i as usize)).collect()),
        }
    }
}

/// A vertex as its index, or nothing.
pub(crate) mod id {
    use cotan::halfedge::VertexId;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[allow(
        clippy::trivially_copy_pass_by_ref,
        reason = "the form that serde calls"
    )]
    pub(crate) fn serialize<S: Serializer>(
        id: &Option<VertexId>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        id.map(VertexId::index).serialize(to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Option<VertexId>, D::Error> {
        match Option::<u32>::deserialize(from)? {
            Some(index) if index > i32::MAX as u32 => {
                Err(D::Error::custom(format!("there is no vertex {index}")))
            }
            index => Ok(index.map(|index| VertexId::new(index as usize))),
        }
    }
}

/// Three axes as their coordinates, axis by axis.
pub(crate) mod axes {
    use nalgebra::Matrix3;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(axes: &Matrix3<f64>, to: S) -> Result<S::Ok, S::Error> {
        let columns: [[f64; 3]; 3] = (*axes).into();
        columns.serialize(to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Matrix3<f64>, D::Error> {
        Ok(<[[f64; 3]; 3]>::deserialize(from)?.into())
    }
}

/// A 4 × 4 matrix as its 16 numbers, column by column.
pub(crate) mod matrix {
    use nalgebra::Matrix4;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(
        matrix: &Matrix4<f64>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        let columns: [[f64; 4]; 4] = (*matrix).into();
        columns.serialize(to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Matrix4<f64>, D::Error> {
        Ok(<[[f64; 4]; 4]>::deserialize(from)?.into())
    }
}

/// A vector as its three coordinates.
pub(crate) mod vector {
    use nalgebra::Vector3;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(v: &Vector3<f64>, to: S) -> Result<S::Ok, S::Error> {
        [v.x, v.y, v.z].serialize(to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Vector3<f64>, D::Error> {
        Ok(<[f64; 3]>::deserialize(from)?.into())
    }
}

/// Points as their coordinates.
pub(crate) mod points {
    use nalgebra::Point3;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(crate) fn serialize<S: Serializer>(
        points: &[Point3<f64>],
        to: S,
    ) -> Result<S::Ok, S::Error> {
        to.collect_seq(points.iter().map(|p| [p.x, p.y, p.z]))
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Vec<Point3<f64>>, D::Error> {
        let points = Vec::<[f64; 3]>::deserialize(from)?;
        Ok(points.into_iter().map(Point3::from).collect())
    }
}

/// Values that have a name on the command line, as that name.
macro_rules! by_name {
    ($module:ident, $type:ty) => {
        pub(crate) mod $module {
            use serde::de::Error;
            use serde::{Deserialize, Deserializer, Serializer};

            pub(crate) fn serialize<S: Serializer>(
                value: &$type,
                to: S,
            ) -> Result<S::Ok, S::Error> {
                to.serialize_str(value.name())
            }

            pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
                from: D,
            ) -> Result<$type, D::Error> {
                let name = String::deserialize(from)?;
                name.parse().map_err(D::Error::custom)
            }
        }
    };
}

by_name!(orientation, cotan::OrientationKind);
by_name!(scheme, cotan::SchemeKind);
by_name!(smooth_method, cotan::smooth::SmoothMethod);

/// The hold of a handle: its weight, or nothing if it holds exactly.
pub(crate) mod hold {
    use cotan::linear::Hold;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(hold: &Hold, to: S) -> Result<S::Ok, S::Error> {
        match *hold {
            Hold::Hard => None,
            Hold::Soft(weight) => Some(weight),
        }
        .serialize(to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Hold, D::Error> {
        let weight = Option::<f64>::deserialize(from)?;
        Ok(weight.map_or(Hold::Hard, Hold::Soft))
    }
}
