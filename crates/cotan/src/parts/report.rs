//! Measures of how well parts follow: the change of their gaps, and their rotation relative to the
//! surface that they touch.

use cotan_flow::nearest_rotation;
use cotan_geometry::Scalar;
use nalgebra::{Matrix3, Vector3};

use super::contacts::{Contact, ContactPoint};
use super::passenger::{Kind, Passenger, Scene};
use super::plan::Plan;
use super::roles::Role;
use super::turns::{covariance_at, rotation};

/// The role of a part in a deformation, and how well it followed.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct PartReport {
    /// Number of its vertices.
    pub vertices: usize,
    /// Its role.
    pub role: Role,
    /// The parts that it touches or is nearest to, ascending.
    pub follows: Vec<usize>,
    /// Weighted root mean square, over its contacts, of the change of the distance from the point
    /// that it touches, relative to the diagonal of the whole model.
    pub gap_change: f64,
    /// The angle between its rotation and that of the surface that it touches, in degrees. A part
    /// that bends turns at its contacts; a rigid one everywhere alike.
    pub turn_degrees: f64,
}

/// Measures all parts.
pub(crate) fn measure<T: Scalar>(
    scene: &Scene<'_>,
    plan: &Plan,
    passengers: &[Passenger<T>],
) -> Vec<PartReport> {
    let parts = scene.model.parts.iter().zip(&plan.roles.roles);
    let mut reports: Vec<PartReport> = parts
        .map(|(part, role)| PartReport::new(part.vertices.len(), *role))
        .collect();
    for passenger in passengers {
        let contacts: Vec<&Contact> = passenger.contacts.iter().collect();
        let report = &mut reports[passenger.part];
        report.note(scene, &contacts);
        let on = passenger.mean_rotation(scene);
        let own = match passenger.kind {
            Kind::Rigid => own_rotation(scene, passenger.part, &on),
            Kind::Decal | Kind::Flowing(_) | Kind::Waiting => {
                rotation_at(scene, &contacts, |c| &c.own)
            }
        };
        report.turn_degrees = angle(&own, &on).to_degrees();
    }
    let part_of = |contact: &Contact| scene.model.of_vertex[contact.own.corners[0] as usize];
    let mut ties: Vec<&Contact> = plan.ties.iter().collect();
    ties.sort_by_key(|contact| part_of(contact));
    for contacts in ties.chunk_by(|a, b| part_of(a) == part_of(b)) {
        let report = &mut reports[part_of(contacts[0]) as usize];
        report.note(scene, contacts);
        let own = rotation_at(scene, contacts, |c| &c.own);
        let on = rotation_at(scene, contacts, |c| &c.on);
        report.turn_degrees = angle(&own, &on).to_degrees();
    }
    reports
}

impl PartReport {
    pub(super) fn new(vertices: usize, role: Role) -> Self {
        Self {
            vertices,
            role,
            follows: Vec::new(),
            gap_change: 0.0,
            turn_degrees: 0.0,
        }
    }

    pub(super) fn set_followed(&mut self, parts: impl Iterator<Item = u32>) {
        self.follows = parts.map(|part| part as usize).collect();
        self.follows.sort_unstable();
        self.follows.dedup();
    }

    /// Records the parts that are followed, and the change of the gaps.
    fn note(&mut self, scene: &Scene<'_>, contacts: &[&Contact]) {
        self.set_followed(contacts.iter().map(|c| c.part));
        let (mut sum, mut total) = (0.0, 0.0);
        for contact in contacts {
            let gap = (contact.own.at(scene.now) - contact.on.at(scene.now)).norm();
            sum += contact.weight * (gap - contact.distance).powi(2);
            total += contact.weight;
        }
        if total > 0.0 && scene.model.diagonal > 0.0 {
            self.gap_change = (sum / total).sqrt() / scene.model.diagonal;
        }
    }
}

/// The rotation of one side of contacts: the one nearest to the mean of those at their points.
fn rotation_at(
    scene: &Scene<'_>,
    contacts: &[&Contact],
    side: impl Fn(&Contact) -> &ContactPoint,
) -> Matrix3<f64> {
    rotation(&contacts.iter().fold(Matrix3::zeros(), |sum, contact| {
        sum + covariance_at(scene.model, scene.now, side(contact)) * contact.weight
    }))
}

/// The rotation that best takes the original positions of a part's vertices to the current ones.
/// If they are on a line or at a point, of all such rotations the one closest to `otherwise`.
fn own_rotation(scene: &Scene<'_>, part: usize, otherwise: &Matrix3<f64>) -> Matrix3<f64> {
    /// Relative to the squared size of the model: negligible for anything with an extent.
    const SHARE: f64 = 1e-14;
    let vertices = &scene.model.parts[part].vertices;
    let rest = scene.model.positions.as_slice();
    let mean = |at: &dyn Fn(usize) -> Vector3<f64>| {
        let sum: Vector3<f64> = vertices.iter().map(|v| at(*v as usize)).sum();
        sum / vertices.len().max(1) as f64
    };
    let before = mean(&|v| rest[v].coords);
    let after = mean(&|v| scene.now[v].coords);
    let mut covariance = Matrix3::zeros();
    for v in vertices {
        let v = *v as usize;
        covariance += (scene.now[v].coords - after) * (rest[v].coords - before).transpose();
    }
    let size = scene.model.diagonal * scene.model.diagonal * vertices.len() as f64;
    nearest_rotation(&(covariance + otherwise * (SHARE * size)))
}

/// The angle of the rotation from one to the other, computed from the chord, since an arc cosine
/// loses the digits of small angles.
fn angle(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    2.0 * ((a - b).norm() / 8.0_f64.sqrt()).min(1.0).asin()
}
