//! Models made by code, each with a natural edit.

use cotan::prelude::*;
use cotan::shapes::{bar, icosphere, torus};
use nalgebra::Similarity3;

use crate::models::{together, turn};

/// A model, its edit, and what is expected of its parts.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    pub(crate) parts: Vec<Mesh<f64>>,
    /// The part that is held, and where.
    pub(crate) still: (usize, fn(&Point3<f64>) -> bool),
    /// The part that is moved, where, and how.
    pub(crate) moved: (usize, fn(&Point3<f64>) -> bool),
    pub(crate) motion: Matrix4<f64>,
}

impl Case {
    pub(crate) fn shape(&self) -> Mesh<f64> {
        together(&self.parts)
    }
}

/// A mesh moved, turned about an axis and scaled.
fn placed(mesh: &Mesh<f64>, to: [f64; 3], turn: [f64; 3], scale: f64) -> Mesh<f64> {
    let similarity = Similarity3::new(to.into(), turn.into(), scale);
    let positions = mesh.positions().map(|p| similarity * p);
    mesh.with_positions(positions).unwrap()
}

fn at(mesh: &Mesh<f64>, to: [f64; 3]) -> Mesh<f64> {
    placed(mesh, to, [0.0; 3], 1.0)
}

fn mapped(mesh: &Mesh<f64>, map: impl Fn(&Point3<f64>) -> Point3<f64>) -> Mesh<f64> {
    mesh.with_positions(mesh.positions().map(|p| map(p)))
        .unwrap()
}

/// A flat sheet in x and y, of so many cells.
fn sheet(size: [f64; 2], cells: [usize; 2]) -> Mesh<f64> {
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    let row = cells[0] as u32 + 1;
    for j in 0..=cells[1] {
        for i in 0..=cells[0] {
            let x = size[0] * (i as f64 / cells[0] as f64 - 0.5);
            let y = size[1] * (j as f64 / cells[1] as f64 - 0.5);
            points.push(Point3::new(x, y, 0.0));
        }
    }
    for j in 0..cells[1] as u32 {
        for i in 0..cells[0] as u32 {
            let v = j * row + i;
            faces.extend([[v, v + 1, v + row + 1], [v, v + row + 1, v + row]]);
        }
    }
    let mesh = HalfedgeMesh::from_faces(points.len(), &faces).unwrap();
    Mesh::new(mesh, points.into_iter().collect()).unwrap()
}

/// A plate with an edge held and the other one bent up by 60°.
fn on_a_plate(name: &'static str, others: Vec<Mesh<f64>>) -> Case {
    let plate = bar::<f64>([4.0, 2.0, 0.2], [32, 16, 2]);
    let parts = std::iter::once(plate).chain(others).collect();
    Case {
        name,
        parts,
        still: (0, |p| p.x < -1.9),
        moved: (0, |p| p.x > 1.9),
        motion: turn([1.0, 0.0, 0.0], -Vector3::y(), 60.0),
    }
}

/// So many screws per side, half sunk into the plate.
pub(crate) fn screws(per_side: usize) -> Case {
    let screw = bar::<f64>([1.0, 1.0, 2.0], [2, 2, 4]);
    let step = 1.0 / per_side as f64;
    let place = |k: usize| {
        let (i, j) = (k % per_side, k / per_side);
        let x = 3.6 * ((i as f64 + 0.5) * step - 0.5);
        let y = 1.8 * ((j as f64 + 0.5) * step - 0.5);
        placed(&screw, [x, y, 0.12], [0.0, 0.0, k as f64], 0.3 * step)
    };
    on_a_plate(
        "screws on a plate",
        (0..per_side * per_side).map(place).collect(),
    )
}

/// A head with cards of hair that stand out of it, turned at the crown.
pub(crate) fn hair(num_cards: usize) -> Case {
    let card = sheet([0.08, 0.5], [1, 6]);
    let place = |k: usize| {
        // Spread over the upper half by the golden angle.
        let z = 0.1 + 0.7 * (k as f64 + 0.5) / num_cards as f64;
        let angle = 2.399_963 * k as f64;
        let radius = (1.0 - z * z).sqrt();
        let normal = Vector3::new(radius * angle.cos(), radius * angle.sin(), z);
        let turn = Rotation3::rotation_between(&Vector3::y(), &normal).unwrap();
        let root = normal * 1.24;
        placed(&card, root.into(), turn.scaled_axis().into(), 1.0)
    };
    let head = icosphere::<f64>(3);
    Case {
        name: "hair cards on a head",
        parts: std::iter::once(head)
            .chain((0..num_cards).map(place))
            .collect(),
        still: (0, |p| p.z < -0.7),
        moved: (0, |p| p.z > 0.9),
        motion: turn([0.0, 0.0, -0.7], Vector3::x(), 20.0),
    }
}

/// Four pieces in a row with gaps, the last one dragged.
pub(crate) fn arm() -> Case {
    let piece = bar::<f64>([1.0, 0.4, 0.4], [12, 4, 4]);
    let parts = (0..4)
        .map(|k| at(&piece, [1.04 * f64::from(k), 0.0, 0.0]))
        .collect();
    Case {
        name: "arm of four pieces",
        parts,
        still: (0, |p| p.x < -0.4),
        moved: (3, |p| p.x > 3.5),
        motion: turn([2.0, 0.0, 0.0], Vector3::z(), 40.0),
    }
}

fn decal() -> Case {
    let decal = at(&sheet([1.6, 0.8], [16, 8]), [0.3, 0.1, 0.101]);
    on_a_plate("decal", vec![decal])
}

fn nested() -> Case {
    let outer = bar::<f64>([4.0, 1.0, 1.0], [32, 8, 8]);
    let inner = bar::<f64>([3.6, 0.8, 0.8], [24, 6, 6]);
    Case {
        name: "nested boxes",
        parts: vec![outer, inner],
        still: (0, |p| p.x < -1.9),
        moved: (0, |p| p.x > 1.9),
        motion: turn([1.0, 0.0, 0.0], Vector3::z(), 45.0),
    }
}

fn jaw() -> Case {
    let bent = |p: &Point3<f64>| {
        let angle = p.x / 1.5;
        let radius = 1.5 + p.y;
        Point3::new(radius * angle.sin(), radius * angle.cos(), p.z)
    };
    let jaw = mapped(&bar::<f64>([4.0, 0.4, 0.4], [40, 4, 4]), bent);
    let tooth = bar::<f64>([0.16, 0.16, 0.4], [2, 2, 4]);
    let place = |k: i32| mapped(&at(&tooth, [0.3 * f64::from(k), 0.0, 0.3]), bent);
    Case {
        name: "jaw with teeth",
        parts: std::iter::once(jaw).chain((-5..=5).map(place)).collect(),
        still: (0, |p| p.x < -1.0 && p.y < 0.8),
        moved: (0, |p| p.x > 1.0 && p.y < 0.8),
        motion: turn([0.0, 1.5, 0.0], Vector3::x(), -25.0),
    }
}

fn intersecting() -> Case {
    let body = bar::<f64>([4.0, 0.6, 0.6], [32, 5, 5]);
    let ring = placed(
        &torus::<f64>(0.5, 0.15, 24, 10),
        [0.4, 0.0, 0.0],
        [0.0, std::f64::consts::FRAC_PI_2, 0.0],
        1.0,
    );
    Case {
        name: "parts that intersect",
        parts: vec![body, ring],
        still: (0, |p| p.x < -1.9),
        moved: (0, |p| p.x > 1.9),
        motion: turn([1.0, 0.0, 0.0], Vector3::z(), 45.0),
    }
}

fn far() -> Case {
    let ball = placed(&icosphere::<f64>(2), [1.0, 0.0, 1.5], [0.0; 3], 0.2);
    on_a_plate("a part far away", vec![ball])
}

/// A copy of the plate itself, and one of a screw.
pub(crate) fn duplicates() -> Case {
    let plate = bar::<f64>([4.0, 2.0, 0.2], [32, 16, 2]);
    let screw = placed(&icosphere::<f64>(1), [0.5, 0.2, 0.12], [0.0; 3], 0.1);
    on_a_plate("exact duplicates", vec![plate, screw.clone(), screw])
}

/// A strip whose vertices are on a line, and one whose vertices are in one point.
fn without_area() -> Case {
    let strip = sheet([1.0, 0.2], [8, 1]);
    let line = mapped(&strip, |p| Point3::new(p.x + 0.2 * p.y, 0.0, 0.12));
    let point = mapped(&strip, |_| Point3::new(0.7, 0.3, 0.15));
    on_a_plate("parts without area", vec![line, point])
}

/// All models, small ones.
pub(crate) fn all() -> Vec<Case> {
    vec![
        screws(8),
        hair(40),
        arm(),
        decal(),
        nested(),
        jaw(),
        intersecting(),
        far(),
        duplicates(),
        without_area(),
    ]
}
